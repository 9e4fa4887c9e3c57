"""What gates read from a quantity over time. Plain Python."""


def tenth(values, k):
    """Mean of the k-th last tenth."""
    n = len(values)
    part = values[n - (k + 1) * n // 10:n - k * n // 10]
    return sum(part) / len(part)

/* placeholder */
#include "pd.h"

#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Static solutions of benchmark solids by finite elements, for docs/finite_elements.md.

    apt-get install --no-install-recommends python3-dolfinx   # Debian 12
    scripts/finite_elements.py <problem> [n=8] [nuStab=0.4] [element=Q2] [steps=10]

Problems: compressed_block cooks_membrane torsion panel. n is the number of elements along
the shortest edge or part of one (torsion and panel: across), nuStab as in [kim2023] eq. 45,
steps those of the load. Elements: Q2 (displacements), Q3, or Q2Q1 (Taylor-Hood with the
pressure kappa ln J), which does not lock as nuStab goes to 0.5. Meshes are finer towards
the ends of edges, where solutions are singular. Not part of the tests.
"""

import logging
import sys

import dolfinx.fem.petsc
import dolfinx.nls.petsc
import numpy as np
import ufl
from dolfinx import fem, geometry, mesh
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

logging.disable(logging.INFO)  # FFCx tells about its compiler


# --- meshes -----------------------------------------------------------------------------

def graded(points, cells):
    """Coordinates of nodes along an axis, finer towards each of the points."""
    parts = [a + (b - a) * t * t * (3 - 2 * t)
             for a, b, n in zip(points, points[1:], cells)
             for t in [np.arange(n) / n]]
    return np.append(np.concatenate(parts), points[-1])


def grid(*axes):
    """Quadrilaterals or hexahedra between the coordinates given for each axis."""
    cells = [len(axis) - 1 for axis in axes]
    create, shape = {2: (mesh.create_rectangle, mesh.CellType.quadrilateral),
                     3: (mesh.create_box, mesh.CellType.hexahedron)}[len(axes)]
    box = create(MPI.COMM_SELF, [[0.0] * len(axes), cells], cells, shape)
    for i, axis in enumerate(axes):
        box.geometry.x[:, i] = np.interp(box.geometry.x[:, i], range(len(axis)), axis)
    return box


# --- energies, per volume at rest -------------------------------------------------------

def in_space(F):
    """F with the third direction of plane strain."""
    if F.ufl_shape == (3, 3):
        return F
    return ufl.as_matrix([[F[0, 0], F[0, 1], 0], [F[1, 0], F[1, 1], 0], [0, 0, 1]])


def volumetric(J, kappa, p):
    """kappa/2 (ln J)^2, or what is stationary at p = kappa ln J."""
    return kappa / 2 * ufl.ln(J)**2 if p is None else p * ufl.ln(J) - p**2 / (2 * kappa)


def kappa_stab(G, nu_stab):
    return 2 * G * (1 + nu_stab) / (3 * (1 - 2 * nu_stab))


def neo_hookean(G, nu_stab):
    """[kim2023] eqs 43-45."""
    def energy(F, p):
        F = in_space(F)
        J = ufl.det(F)
        isochoric = G / 2 * (J**(-2 / 3) * ufl.tr(F.T * F) - 3)
        return isochoric + volumetric(J, kappa_stab(G, nu_stab), p)
    return energy


def mooney_rivlin(c1, c2, nu_stab):
    """[kim2023] eqs 46-47; the constant differs."""
    def energy(F, p):
        C, J = F.T * F, ufl.det(F)
        I1 = ufl.tr(C)
        I2 = I1**2 - ufl.tr(C * C)
        isochoric = c1 * (J**(-2 / 3) * I1 - 3) + c2 * (J**(-4 / 3) * I2 / 2 - 3)
        return isochoric + volumetric(J, kappa_stab(c1 + c2, nu_stab), p)
    return energy


def saint_venant_kirchhoff(E, nu):
    """Plane stress."""
    def energy(F, p):
        strain = (F.T * F - ufl.Identity(2)) / 2
        return E / (1 - nu**2) / 2 * ((1 - nu) * ufl.inner(strain, strain)
                                      + nu * ufl.tr(strain)**2)
    return energy


# --- solution ---------------------------------------------------------------------------

class Solid:
    """holds: (where(x), component, displacement(x, share of the load) or None for zero).
    traction(x): force per area at rest, in UFL, over the whole boundary."""

    def __init__(self, domain, element, energy, holds, traction=None):
        cell = domain.ufl_cell()
        displacement = ufl.VectorElement("Q", cell, int(element[1]))
        self.mixed = len(element) == 4
        if self.mixed:
            displacement *= ufl.FiniteElement("Q", cell, int(element[3]))
        space = fem.FunctionSpace(domain, displacement)
        self.w = fem.Function(space)
        u, p = ufl.split(self.w) if self.mixed else (self.w, None)
        self.domain = domain
        self.displacement = u
        self.F = ufl.Identity(domain.geometry.dim) + ufl.grad(u)
        self.share = fem.Constant(domain, 0.0)
        self.dx = ufl.dx(metadata={"quadrature_degree": 6})
        work = energy(self.F, p) * self.dx
        if traction:
            x = ufl.SpatialCoordinate(domain)
            work -= self.share * ufl.inner(traction(x), u) * ufl.ds
        self.residual = ufl.derivative(work, self.w)
        self.held = [self.hold(*h) for h in holds]
        self.bcs = [bc for _, _, bc in self.held]

    def displacement_space(self):
        return self.w.function_space.sub(0) if self.mixed else self.w.function_space

    def hold(self, where, component, displacement):
        part = self.displacement_space().sub(component)
        collapsed, _ = part.collapse()
        value = fem.Function(collapsed)
        dofs = fem.locate_dofs_geometrical((part, collapsed), where)
        if not len(dofs[0]):
            sys.exit("a hold is nowhere on the mesh")
        return value, displacement, fem.dirichletbc(value, dofs, part)

    def guess(self, displacement):
        (self.w.sub(0) if self.mixed else self.w).interpolate(displacement)

    def interpolated(self, x):
        """The displacement at any points: a guess for a finer mesh."""
        tree = geometry.BoundingBoxTree(self.domain, self.domain.topology.dim, padding=1e-9)
        near = geometry.compute_collisions(tree, x.T)
        cells = geometry.compute_colliding_cells(self.domain, near, x.T)
        u = self.w.sub(0).collapse() if self.mixed else self.w
        return u.eval(x.T, [cells.links(i)[0] for i in range(x.shape[1])]).T

    def solve(self, steps):
        problem = fem.petsc.NonlinearProblem(self.residual, self.w, self.bcs)
        newton = dolfinx.nls.petsc.NewtonSolver(MPI.COMM_SELF, problem)
        newton.convergence_criterion = "incremental"
        newton.rtol, newton.atol, newton.max_it = 1e-9, 1e-10, 25
        options = PETSc.Options()
        for key, value in {"ksp_type": "preonly", "pc_type": "lu",
                           "pc_factor_mat_solver_type": "mumps"}.items():
            options[newton.krylov_solver.getOptionsPrefix() + key] = value
        newton.krylov_solver.setFromOptions()
        before = self.w.x.array.copy()
        for step in range(1, steps + 1):
            self.share.value = step / steps
            for value, displacement, _ in self.held:
                if displacement:
                    value.interpolate(lambda x: displacement(x, step / steps))
            now = self.w.x.array.copy()
            if step > 1:
                self.w.x.array[:] = 2 * now - before
            before = now
            newton.solve(self.w)

    def frequencies(self, rho, count):
        """The lowest, about the present state; displacement elements only."""
        du = ufl.TrialFunction(self.w.function_space)
        v = ufl.TestFunction(self.w.function_space)
        matrices = []
        for form, diagonal in ((ufl.derivative(self.residual, self.w, du), 1.0),
                               (rho * ufl.inner(du, v) * ufl.dx, 0.0)):
            matrices.append(fem.petsc.assemble_matrix(fem.form(form), self.bcs, diagonal))
            matrices[-1].assemble()
        solver = SLEPc.EPS().create(MPI.COMM_SELF)
        solver.setOperators(*matrices)
        solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        solver.setTarget(0)
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.setDimensions(count)
        solver.getST().setType(SLEPc.ST.Type.SINVERT)
        solver.solve()
        return [np.sqrt(solver.getEigenvalue(i).real) / (2 * np.pi) for i in range(count)]

    def u(self):
        """Nodes at rest and their displacements."""
        u = self.w.sub(0).collapse() if self.mixed else self.w
        X = u.function_space.tabulate_dof_coordinates()
        return X, u.x.array.reshape(len(X), -1)

    def at(self, *point):
        X, u = self.u()
        distance = np.linalg.norm(X[:, :len(point)] - point, axis=1)
        return u[distance.argmin()]

    def volume_change(self):
        one = fem.Constant(self.domain, 1.0)
        return (fem.assemble_scalar(fem.form(ufl.det(self.F) * self.dx))
                / fem.assemble_scalar(fem.form(one * self.dx)) - 1)


# --- problems ---------------------------------------------------------------------------

def compressed_block(n=8, nuStab=0.4, element="Q2", steps=10):
    """[kim2023] section 4.1.1."""
    block = grid(graded([10, 15, 25, 30], [n, 2 * n, n]), graded([15, 25], [2 * n]))
    solid = Solid(
        block, element, neo_hookean(80.194, nuStab),
        [(lambda x: np.isclose(x[1], 25), 0, None),
         (lambda x: np.isclose(x[1], 15), 1, None),
         (lambda x: np.isclose(x[0], 20) & np.isclose(x[1], 15), 0, None)],
        lambda x: ufl.as_vector([0, ufl.conditional(
            ufl.And(x[1] > 25 - 1e-6, abs(x[0] - 20) < 5), -200.0, 0.0)]))
    solid.solve(steps)
    ux, uy = solid.at(20, 25)
    return {"u_x": ux, "u_y": uy, "mean J-1": solid.volume_change()}


def cooks_membrane(n=8, nuStab=0.4, element="Q2", steps=5):
    """[kim2023] section 4.1.2."""
    membrane = grid(graded([0, 1], [n]), graded([0, 1], [n]))
    s, t = membrane.geometry.x[:, :2].T.copy()
    membrane.geometry.x[:, 0] = 4.8 * s
    membrane.geometry.x[:, 1] = 4.4 * s + (4.4 - 2.8 * s) * t
    solid = Solid(
        membrane, element, neo_hookean(250 / 3, nuStab),
        [(lambda x: np.isclose(x[0], 0), i, None) for i in (0, 1)],
        lambda x: ufl.as_vector([0, ufl.conditional(x[0] > 4.8 - 1e-6, 6.25, 0.0)]))
    solid.solve(steps)
    ux, uy = solid.at(4.8, 6)
    return {"u_x": ux, "u_y": uy, "mean J-1": solid.volume_change()}


def turned(x, angle):
    """The displacement of a turn about the x axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([0 * x[0], c * x[1] - s * x[2] - x[1], s * x[1] + c * x[2] - x[2]])


def torsion_solution(n, nuStab, element, steps):
    angle = 2.5 * np.pi
    across = graded([-0.5, 0.5], [n])
    solid = Solid(
        grid(graded([-3, 3], [4 * n]), across, across), element,
        mooney_rivlin(9000, 9000, nuStab),
        [(lambda x: np.isclose(x[0], -3), i, None) for i in (0, 1, 2)]
        + [(lambda x: np.isclose(x[0], 3), i,
            lambda x, share, i=i: turned(x, share * angle)[i]) for i in (1, 2)])
    if steps == 1 and n > 5:
        solid.guess(torsion_solution(n // 2, nuStab, element, 1).interpolated)
    elif steps == 1 and nuStab > 0.31:  # from half of kappa, nearly
        softer = torsion_solution(n, max(0.3, 2 * nuStab - 0.5), element, 1)
        solid.w.x.array[:] = softer.w.x.array
    elif steps == 1:
        solid.guess(lambda x: turned(x, angle * (x[0] + 3) / 6))
    solid.solve(steps)
    return solid


def torsion(n=8, nuStab=0.4, element="Q2", steps=1):
    """[kim2023] section 4.1.3. In one step: from a uniform twist, where J = 1, then from
    smaller nuStab and from meshes half as fine. In about 25 from rest, as a check."""
    solid = torsion_solution(n, nuStab, element, steps)
    x = ufl.SpatialCoordinate(solid.domain)
    face = ufl.conditional(x[0] > 3 - 1e-6, 1.0, 0.0)  # its area is 1
    average = fem.assemble_scalar(fem.form(solid.displacement[0] * face * ufl.ds))
    return {"u_x centre": solid.at(3, 0, 0)[0], "u_x average": average,
            "mean J-1": solid.volume_change()}


def panel(n=2, nu=0.3, element="Q2", steps=5):
    """A cantilever in plane stress, 1 x 50 mm, 100 kPa on its left side; SI units."""
    E, rho, height, width = 220e9, 7850, 0.05, 0.001
    solid = Solid(
        grid(graded([0, width], [n]), graded([0, height], [10 * n])), element,
        saint_venant_kirchhoff(E, nu),
        [(lambda x: np.isclose(x[1], 0), i, None) for i in (0, 1)],
        lambda x: ufl.as_vector([ufl.conditional(x[0] < 1e-9, 1e5, 0.0), 0]))
    frequencies = solid.frequencies(rho, 2)
    solid.solve(steps)
    ux, uy = solid.at(width / 2, height)
    return {"u_x": ux, "u_y": uy, "f1": frequencies[0], "f2": frequencies[1]}


def main(name="", *settings):
    problems = {p.__name__: p for p in (compressed_block, cooks_membrane, torsion, panel)}
    if name not in problems:
        sys.exit(__doc__)
    values = dict(setting.split("=") for setting in settings)
    values = {key: value if key == "element" else
              int(value) if key in ("n", "steps") else float(value)
              for key, value in values.items()}
    for quantity, value in problems[name](**values).items():
        print(f"{quantity:12} {value:.8g}")


main(*sys.argv[1:])

"""The turbulent boundary layer over a bed line: k-epsilon in numpy and scipy, steady, in the plane.

Finite volumes between vertical grid lines that follow the bed, all unknowns at the centres of the
cells. The equations are linear in turn (SIMPLEC); each is solved directly. The wall is rough: the
stress on it is u*_k u*_log with u*_k = C_mu^(1/4) sqrt(k) and u*_log = kappa U/ln((z + z0)/z0).
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

KAPPA, C_MU, C1, C2, SIGMA_K = 0.41, 0.09, 1.44, 1.92, 1.0
SIGMA_E = KAPPA**2 / (
    (C2 - C1) * C_MU**0.5
)  # with it the log layer solves the equations
RELAX, CAREFUL, HURRY = 0.8, 0.5, 200
"""What is kept of an iteration's change, in the first iterations and then: the flow behind a steep
pile swings about its answer for ever with the first."""
START = 60
"""Iterations in which convection goes from first to second order."""
COLUMN, CONVERGED_COLUMN = 0.99, 1e-9
CONVERGED = 5e-4
"""Change of the stress anywhere on the bed in an iteration, over that of the flat bed, at which the
flow is steady. The last to settle is where it reattaches."""
MOST = 2000
"""Iterations."""
ORDER = "MMD_AT_PLUS_A"
"""In which unknowns are eliminated: matrices are nearly symmetric."""


class Grid:
    """Quadrilateral cells between nodes x (nx + 1) and z (nx + 1, nz + 1), m.

    Around the cells lies a ring of boundary values at the middle of the boundary's faces: a field
    with its ring has (nx + 2)(nz + 2) numbers. Faces are those that x crosses, then the others.
    """

    def __init__(self, x, z, eta):
        nx, nz = len(x) - 1, len(eta) - 1
        self.x, self.shape = x, (nx, nz)
        ids = np.arange((nx + 2) * (nz + 2)).reshape(nx + 2, nz + 2)
        self.inner, self.ids = ids[1:-1, 1:-1].ravel(), ids
        xs = np.r_[x[0], (x[1:] + x[:-1]) / 2, x[-1]]
        column = np.vstack([z[0], (z[1:] + z[:-1]) / 2, z[-1]])
        zs = np.c_[column[:, 0], (column[:, 1:] + column[:, :-1]) / 2, column[:, -1]]
        self.centre = np.c_[np.repeat(xs, nz + 2), zs.ravel()]
        self.volume = (np.diff(x)[:, None] * np.diff(column[1:-1], axis=1)).ravel()
        # values at nodes: linear between the centres around them
        above = np.r_[eta[0], (eta[1:] + eta[:-1]) / 2, eta[-1]]
        wx, wz = _weights(x, xs), _weights(eta, above)
        self.nodes = sparse.kron(wx, wz, format="csr")
        node = np.arange((nx + 1) * (nz + 1)).reshape(nx + 1, nz + 1)
        at = np.stack([np.broadcast_to(x[:, None], z.shape), z], axis=-1).reshape(-1, 2)
        self.left = np.r_[ids[:-1, 1:-1].ravel(), ids[1:-1, :-1].ravel()]
        self.right = np.r_[ids[1:, 1:-1].ravel(), ids[1:-1, 1:].ravel()]
        first = np.r_[node[:, :-1].ravel(), node[1:, :].ravel()]
        last = np.r_[node[:, 1:].ravel(), node[:-1, :].ravel()]
        tangent = at[last] - at[first]
        self.area = np.c_[tangent[:, 1], -tangent[:, 0]]
        self.middle = (at[first] + at[last]) / 2
        self.on_edge = ~np.isin(self.left, self.inner) | ~np.isin(
            self.right, self.inner
        )
        self.left_of, self.right_of = self._pick(self.left), self._pick(self.right)
        share = np.r_[np.repeat(wx.data[1::2], nz), np.tile(wz.data[1::2], nx)]
        self.mean = (
            sparse.diags(1 - share) @ self.left_of + sparse.diags(share) @ self.right_of
        )
        # the flux of a gradient through a face: along the line of centres, and along the face
        d = self.centre[self.right] - self.centre[self.left]
        self.direct = (self.area**2).sum(1) / (self.area * d).sum(1)
        skew = -self.direct * (d * tangent).sum(1) / (tangent**2).sum(1)
        self.across = sparse.diags(skew) @ (self.nodes[last] - self.nodes[first])
        self.gradient = (
            sparse.diags(self.direct) @ (self.right_of - self.left_of) + self.across
        )
        # what leaves the cells through their faces
        self.out = (self.left_of - self.right_of).T.tocsr()[self.inner]
        inverse = sparse.diags(1 / self.volume) @ self.out
        self.slope = [
            inverse @ sparse.diags(self.area[:, i]) @ self.mean for i in (0, 1)
        ]
        self.crossed_by_x = np.arange(len(self.left)) < (nx + 1) * nz
        self.bed = (nx + 1) * nz + np.arange(nx) * (nz + 1)  # its faces
        self.wall_cells = np.arange(nx) * nz
        n = -self.area[self.bed] / np.hypot(*self.area[self.bed].T)[:, None]
        self.along = np.c_[-n[:, 1], n[:, 0]]  # of the bed, downstream
        out = self.centre[self.inner[self.wall_cells]] - self.middle[self.bed]
        self.first = -(out * n).sum(1)  # height of the first centres over the bed

    def _pick(self, ids):
        one = np.ones(len(ids))
        return sparse.csr_matrix(
            (one, (np.arange(len(ids)), ids)), (len(ids), self.ids.size)
        )

    def boundary(self, fixed):
        """A field from its cells: no gradient at the sides, but that those in `fixed` keep values.

        Gives the matrix from cells to cells with ring, and where values are kept.
        """
        nx, nz = self.shape
        i, j = np.meshgrid(np.arange(nx + 2), np.arange(nz + 2), indexing="ij")
        near = (np.clip(i, 1, nx) - 1) * nz + np.clip(j, 1, nz) - 1
        held = np.zeros(self.ids.shape, bool)
        for side, where in zip(
            SIDES, (i == 0, i == nx + 1, j == 0, j == nz + 1), strict=True
        ):
            held |= where & (side in fixed)
        keep = np.where(held.ravel(), 0.0, 1.0)
        ring = sparse.csr_matrix((keep, (np.arange(i.size), near.ravel())))
        return ring, held.ravel()


SIDES = ("inlet", "outlet", "bed", "lid")


def _weights(at, between):
    """Linear interpolation from some places to those between them."""
    share = (at - between[:-1]) / np.diff(between)
    rows = np.repeat(np.arange(len(at)), 2)
    columns = rows + np.tile([0, 1], len(at))
    data = np.c_[1 - share, share].ravel()
    return sparse.csr_matrix((data, (rows, columns)), (len(at), len(between)))


@dataclass
class Flow:
    """A flow: values in the cells with their ring, the fluxes, and the stress.

    `stress` is kinematic on each face of the bed, positive where the flow there goes downstream;
    `change` its largest change in the last iteration over the approaching stress.
    """

    u: np.ndarray
    w: np.ndarray
    p: np.ndarray
    k: np.ndarray
    epsilon: np.ndarray
    flux: np.ndarray
    stress: np.ndarray
    iterations: int = 0
    change: float = np.inf


class Solver:
    """The equations on a grid; `inlet` is False for a column without a begin and an end."""

    def __init__(self, grid, z0, nu, *, inlet=True):
        self.grid, self.nu, self.inlet = grid, nu, inlet
        begin = ("inlet",) if inlet else ()
        self.speed = grid.boundary((*begin, "bed", "lid"))
        self.pressure = grid.boundary(("outlet",))
        self.energy = grid.boundary(begin)
        self.rate = grid.boundary((*begin, "lid"))
        self.spread = grid.boundary(())[0]  # of what is known in the cells alone
        self.open = ~grid.on_edge | np.isin(grid.right, grid.ids[-1])
        self.law = np.log((grid.first + z0) / z0) / KAPPA
        self.reach = KAPPA * (grid.first + z0)

    def run(self, flow, ustar, say=None):
        """Iterate until the stress on the bed stays."""
        enough = CONVERGED if self.inlet else CONVERGED_COLUMN
        before = flow.stress
        for flow.iterations in range(1, MOST + 1):
            self.relax = (
                COLUMN
                if not self.inlet
                else RELAX
                if flow.iterations < HURRY
                else CAREFUL
            )
            self.second = min(flow.iterations / START, 1.0) ** 2
            self._iterate(flow)
            flow.change = np.abs(flow.stress - before).max() / ustar**2
            before = flow.stress
            if say:
                say(flow)
            if flow.change < enough:
                return flow
        raise SystemExit(
            f"not steady after {MOST} iterations: {flow.change:.1e} in the last"
        )

    def _iterate(self, flow):
        """Each equation once, in place."""
        g, c = self.grid, self.grid.wall_cells
        viscosity = self.nu + C_MU * flow.k**2 / flow.epsilon
        at_faces = g.mean @ viscosity
        at_faces[g.bed] = 0.0  # the wall's stress takes its place
        u_k = C_MU**0.25 * np.sqrt(flow.k[g.inner[c]])
        grip = u_k / self.law  # stress over speed
        slack, gain = self._momentum(flow, at_faces, grip)
        if self.inlet:
            self._continuity(flow, slack, gain)
        along = flow.u[g.inner[c]] * g.along[:, 0] + flow.w[g.inner[c]] * g.along[:, 1]
        flow.stress = grip * along
        (ux, uz), (wx, wz) = (
            [s @ values for s in g.slope] for values in (flow.u, flow.w)
        )
        made = (viscosity[g.inner] - self.nu) * (2 * ux**2 + 2 * wz**2 + (uz + wx) ** 2)
        made[c] = np.abs(flow.stress) * u_k / self.reach
        k, epsilon = flow.k[g.inner], flow.epsilon[g.inner]
        # Newton's method for the sources: at a given stress the made k goes with k^-2
        source, sink = (C1 * made + C2 * epsilon) * epsilon / k, 2 * C2 * epsilon / k
        self._transport(
            flow, "epsilon", at_faces / SIGMA_E, source, sink, u_k**3 / self.reach
        )
        self._transport(
            flow, "k", at_faces / SIGMA_K, 3 * made, (epsilon + 2 * made) / k
        )

    def _momentum(self, flow, viscosity, grip):
        """Both components of the speed.

        Gives the speed that a pressure gradient makes, alone and with the neighbours (SIMPLEC).
        """
        g, c = self.grid, self.grid.wall_cells
        matrix, known = self._equation(self.speed, flow.flux, viscosity)
        wall = np.zeros(len(g.volume))
        wall[c] = grip * np.hypot(*g.area[g.bed].T)
        diagonal = matrix.diagonal() + wall
        more = diagonal * (1 / self.relax - 1)
        lu = splu((matrix + sparse.diags(wall + more)).tocsc(), permc_spec=ORDER)
        gain = g.volume / (np.asarray(matrix.sum(axis=1)).ravel() + wall + more)
        slopes = [
            [self.spread @ (s @ values) for s in g.slope] for values in (flow.u, flow.w)
        ]
        normal = np.c_[-g.along[:, 1], g.along[:, 0]]
        off = wall[c] * (
            flow.u[g.inner[c]] * normal[:, 0] + flow.w[g.inner[c]] * normal[:, 1]
        )
        for i, values in enumerate((flow.u, flow.w)):
            turned = sum((g.mean @ slopes[j][i]) * g.area[:, j] for j in (0, 1))
            push = g.out @ (viscosity * turned) - g.volume * (g.slope[i] @ flow.p)
            push += known(values) + more * values[g.inner]
            push[c] += off * normal[:, i]  # the wall holds what goes along it alone
            _set(values, self.speed, lu.solve(push))
        return g.volume / diagonal, gain

    def _continuity(self, flow, slack, gain):
        """The pressure that lets nothing be lost; fluxes after Rhie and Chow."""
        g = self.grid
        slack = (g.mean @ (self.spread @ slack)) * self.open
        flux = -slack * (g.gradient @ flow.p)
        for i, values in enumerate((flow.u, flow.w)):
            slope = g.mean @ (self.spread @ (g.slope[i] @ flow.p))
            flux += (g.mean @ values + slack * slope) * g.area[:, i]
        flux[g.bed] = 0.0
        ring, _ = self.pressure
        moved = sparse.diags((g.mean @ (self.spread @ gain)) * self.open) @ g.gradient
        p = ring @ splu((g.out @ moved @ ring).tocsc(), permc_spec=ORDER).solve(
            g.out @ flux
        )
        flow.flux = flux - moved @ p
        flow.p += p
        for i, values in enumerate((flow.u, flow.w)):
            _set(values, self.speed, values[g.inner] - gain * (g.slope[i] @ p))

    def _equation(self, boundary, flux, diffusivity):
        """The matrix of what leaves the cells, and a function for what else is known of it.

        In the matrix faces carry what is upwind of them; that this changes towards the face, and
        that lines of centres do not meet faces at right angles, comes from the last iteration.
        """
        g, (ring, held) = self.grid, boundary
        forward = flux > 0
        upwind = sparse.diags(forward * flux) @ g.left_of
        upwind += sparse.diags(~forward * flux) @ g.right_of
        direct = sparse.diags(diffusivity * g.direct) @ (g.right_of - g.left_of)
        leaves = g.out @ (upwind - direct)
        source = np.where(forward, g.left, g.right)
        ahead = (g.middle - g.centre[source]) * ~g.on_edge[:, None]

        def known(values):
            slopes = [self.spread @ (s @ values) for s in g.slope]
            rise = sum(ahead[:, i] * slopes[i][source] for i in (0, 1))
            late = self.second * flux * rise - diffusivity * (g.across @ values)
            return -g.out @ late - leaves @ np.where(held, values, 0.0)

        return leaves @ ring, known

    def _transport(self, flow, name, diffusivity, source, sink, at_wall=None):
        """One equation of the turbulence; in the cells at the wall a value may be given."""
        g, values = self.grid, getattr(flow, name)
        boundary = {"k": self.energy, "epsilon": self.rate}[name]
        matrix, known = self._equation(boundary, flow.flux, diffusivity)
        right = known(values) + source * g.volume
        more = (matrix.diagonal() + sink * g.volume) * (1 / self.relax - 1)
        matrix += sparse.diags(sink * g.volume + more)
        right += more * values[g.inner]
        if at_wall is not None:
            keep = np.ones(len(right))
            keep[g.wall_cells] = 0.0
            matrix = sparse.diags(keep) @ matrix + sparse.diags(1 - keep)
            right[g.wall_cells] = at_wall
        new = splu(matrix.tocsc(), permc_spec=ORDER).solve(right)
        _set(values, boundary, np.maximum(new, 1e-12))


def _set(values, boundary, cells):
    ring, held = boundary
    values[:] = np.where(held, values, ring @ cells)


@dataclass
class Answer:
    """The stress on a bed.

    `x`, m, are the middles of the bed's faces, `ratio` the signed friction velocity there over that
    of the flat bed far upstream, `own` that of the flat bed over the log layer's.
    """

    x: np.ndarray
    ratio: np.ndarray
    own: float
    flow: Flow


def solve(x, eta, bed, ustar, z0, nu, say=None):
    """Solve the boundary layer over a bed.

    `x` and `eta` are the grid lines, m, eta above flat bed; `bed` is the height of the bed at x,
    m; `ustar` that of the approaching log layer, m/s; `z0` the roughness length, m; `nu` the
    viscosity, m2/s. `say` is called with the flow after each iteration.
    """
    column = Grid(np.r_[0.0, eta[-1]], np.vstack([eta, eta]), eta)
    height = column.centre[:, 1]
    nothing = np.zeros(len(height))
    start = Flow(
        u=ustar / KAPPA * np.log1p(height / z0),
        w=nothing.copy(),
        p=nothing.copy(),
        k=nothing + ustar**2 / C_MU**0.5,
        epsilon=ustar**3 / (KAPPA * (height + z0)),
        flux=np.zeros(len(column.left)),
        stress=np.full(1, ustar**2),
    )
    # what enters has developed on the same rows
    approach = Solver(column, z0, nu, inlet=False).run(start, ustar)
    own = float(np.sqrt(approach.stress[0]))
    grid = Grid(x, eta + bed[:, None] * (1 - eta / eta[-1]), eta)
    rows = {
        name: np.tile(getattr(approach, name).reshape(3, -1)[1], len(x) + 1)
        for name in ("u", "w", "p", "k", "epsilon")
    }
    flux = (grid.mean @ rows["u"]) * np.where(grid.crossed_by_x, grid.area[:, 0], 0.0)
    flow = Flow(**rows, flux=flux, stress=np.full(len(bed) - 1, own**2))
    Solver(grid, z0, nu).run(flow, own, say)
    ratio = np.sign(flow.stress) * np.sqrt(np.abs(flow.stress)) / own
    return Answer(grid.middle[grid.bed, 0], ratio, own / ustar, flow)

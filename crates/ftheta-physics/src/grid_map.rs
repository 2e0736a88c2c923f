//! A map of a square of the plane as values on a regular grid, read between them by bilinear or
//! Catmull-Rom interpolation.
//!
//! This is what controllers and calibration files hold: values alone, no slopes. Where the exact
//! map is at hand as code, [`crate::map_table`] is finer.

use std::sync::Arc;

/// How values between the nodes are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// From the four nodes around: continuous, error quadratic in the pitch.
    Bilinear,
    /// From sixteen nodes: smooth, error cubic in the pitch.
    CatmullRom,
}

/// Two values on each node of a square grid around zero. Clones share them.
#[derive(Clone, Debug, PartialEq)]
pub struct GridMap {
    half_width: f64,
    n_nodes: usize,
    cells_per_unit: f64,
    /// Index of the last cell of a row.
    last_cell: f64,
    interpolation: Interpolation,
    /// Row by row, with a ring around that continues the grid by second order.
    padded: Arc<[[f64; 2]]>,
}

impl GridMap {
    /// Fewest nodes along a side.
    pub const N_NODES_MIN: usize = 3;

    /// A map from its nodes.
    ///
    /// * `half_width`: the grid spans ± this in both coordinates, above zero
    /// * `nodes`: n × n values, rows of rising v, in a row rising u; n at least 3
    /// * returns `None` for any other number of nodes or a half width that is not above zero
    pub fn new(half_width: f64, interpolation: Interpolation, nodes: &[[f64; 2]]) -> Option<Self> {
        let n_nodes = nodes.len().isqrt();
        let fits = n_nodes * n_nodes == nodes.len() && n_nodes >= Self::N_NODES_MIN;
        let wide = half_width.is_finite() && half_width > 0.0;
        (fits && wide).then(|| Self {
            half_width,
            n_nodes,
            cells_per_unit: (n_nodes - 1) as f64 / (2.0 * half_width),
            last_cell: (n_nodes - 2) as f64,
            interpolation,
            padded: padded(nodes, n_nodes).into(),
        })
    }

    /// A map from a function of both coordinates; `None` where it has no value.
    ///
    /// * `n_nodes`: along a side, at least 3
    pub fn tabled(
        half_width: f64,
        interpolation: Interpolation,
        n_nodes: usize,
        mut value: impl FnMut(f64, f64) -> Option<[f64; 2]>,
    ) -> Option<Self> {
        let at = |index: usize| Self::coordinate(half_width, n_nodes, index);
        let mut nodes = Vec::with_capacity(n_nodes * n_nodes);
        for row in 0..n_nodes {
            for column in 0..n_nodes {
                nodes.push(value(at(column), at(row))?);
            }
        }
        Self::new(half_width, interpolation, &nodes)
    }

    /// Coordinate of a row or column.
    fn coordinate(half_width: f64, n_nodes: usize, index: usize) -> f64 {
        half_width * (2.0 * index as f64 / (n_nodes - 1) as f64 - 1.0)
    }

    /// Half the side of the grid's square.
    pub fn half_width(&self) -> f64 {
        self.half_width
    }

    /// Nodes along a side.
    pub fn n_nodes(&self) -> usize {
        self.n_nodes
    }

    /// How values between the nodes are found.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// All nodes with their places: (u, v, values), rows of rising v.
    pub fn nodes(&self) -> impl Iterator<Item = (f64, f64, [f64; 2])> + '_ {
        let at = |index: usize| Self::coordinate(self.half_width, self.n_nodes, index);
        let width = self.n_nodes + 2;
        (0..self.n_nodes * self.n_nodes).map(move |index| {
            let (row, column) = (index / self.n_nodes, index % self.n_nodes);
            (at(column), at(row), self.padded[(row + 1) * width + column + 1])
        })
    }

    /// The values at a place; outside the square those of the nearest place on its border.
    #[inline]
    pub fn value(&self, place: [f64; 2]) -> [f64; 2] {
        match self.interpolation {
            Interpolation::Bilinear => self.bilinear(place),
            Interpolation::CatmullRom => self.catmull_rom(place),
        }
    }

    /// The values at many places; the shorter slice decides how many.
    ///
    /// The choice of interpolation is made once here, which is worth a third of the time.
    pub fn map(&self, places: &[[f64; 2]], values: &mut [[f64; 2]]) {
        let pairs = places.iter().zip(values);
        match self.interpolation {
            Interpolation::Bilinear => pairs.for_each(|(&at, value)| *value = self.bilinear(at)),
            Interpolation::CatmullRom => {
                pairs.for_each(|(&at, value)| *value = self.catmull_rom(at));
            }
        }
    }

    #[inline(always)]
    fn bilinear(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let ((column, s), (row, t)) = (self.cell(u), self.cell(v));
        self.blend(column + 1, row + 1, linear(s), linear(t))
    }

    #[inline(always)]
    fn catmull_rom(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let ((column, s), (row, t)) = (self.cell(u), self.cell(v));
        self.blend(column, row, cubic(s), cubic(t))
    }

    /// Slopes of both values by u and by v: `[[du, dv], [du, dv]]`.
    pub fn slopes(&self, [u, v]: [f64; 2]) -> [[f64; 2]; 2] {
        let ((column, s), (row, t)) = (self.cell(u), self.cell(v));
        let [by_u, by_v] = match self.interpolation {
            Interpolation::Bilinear => {
                let at = |a, b| self.blend::<2>(column + 1, row + 1, a, b);
                [at([-1.0, 1.0], linear(t)), at(linear(s), [-1.0, 1.0])]
            }
            Interpolation::CatmullRom => {
                let at = |a, b| self.blend::<4>(column, row, a, b);
                [at(cubic_slope(s), cubic(t)), at(cubic(s), cubic_slope(t))]
            }
        };
        let scale = self.cells_per_unit;
        [0, 1].map(|index| [by_u[index] * scale, by_v[index] * scale])
    }

    /// Cell of a coordinate, and the share of it passed.
    ///
    /// Added to 2⁵², a number keeps its whole part alone, in the low bits: cheaper than a
    /// conversion that has to mind every number there is. On a node this may be the cell before,
    /// passed wholly, which is the same place. NaN gives cell 0 and stays NaN.
    #[inline(always)]
    fn cell(&self, coordinate: f64) -> (usize, f64) {
        const WHOLE: f64 = (1u64 << 52) as f64;
        let cells = (coordinate + self.half_width) * self.cells_per_unit;
        let cells = cells.clamp(0.0, self.last_cell + 1.0);
        let whole = (cells - 0.5).max(0.0).min(self.last_cell) + WHOLE;
        (whole.to_bits() as u32 as usize, cells - (whole - WHOLE))
    }

    /// Weighted sum over N × N nodes of the padded grid from (column, row) on.
    #[inline(always)]
    fn blend<const N: usize>(
        &self,
        column: usize,
        row: usize,
        by_u: [f64; N],
        by_v: [f64; N],
    ) -> [f64; 2] {
        let width = self.n_nodes + 2;
        // Down the columns first: so many sums of their own keep the adders busy.
        let mut columns = [[0.0; 2]; N];
        for (k, weight) in by_v.into_iter().enumerate() {
            let start = (row + k) * width + column;
            let nodes: &[[f64; 2]; N] =
                self.padded[start..].first_chunk().expect("the padding lies around every cell");
            for index in 0..N {
                columns[index][0] += weight * nodes[index][0];
                columns[index][1] += weight * nodes[index][1];
            }
        }
        let mut value = [0.0; 2];
        for index in 0..N {
            value[0] += by_u[index] * columns[index][0];
            value[1] += by_u[index] * columns[index][1];
        }
        value
    }
}

#[inline(always)]
fn linear(s: f64) -> [f64; 2] {
    [1.0 - s, s]
}

/// Weights of Catmull and Rom's cubic at share `s` of the middle cell.
#[inline(always)]
fn cubic(s: f64) -> [f64; 4] {
    let r = 1.0 - s;
    [
        -0.5 * s * r * r,
        r * (1.0 + s * (1.0 - 1.5 * s)),
        s * (0.5 + s * (2.0 - 1.5 * s)),
        -0.5 * s * s * r,
    ]
}

/// Slopes of these weights.
#[inline]
fn cubic_slope(s: f64) -> [f64; 4] {
    [
        -0.5 + s * (2.0 - 1.5 * s),
        s * (4.5 * s - 5.0),
        0.5 + s * (4.0 - 4.5 * s),
        s * (1.5 * s - 1.0),
    ]
}

/// The nodes with a ring around them.
fn padded(nodes: &[[f64; 2]], n_nodes: usize) -> Vec<[f64; 2]> {
    let width = n_nodes + 2;
    let mut all = vec![[0.0; 2]; width * width];
    for (index, &node) in nodes.iter().enumerate() {
        all[(index / n_nodes + 1) * width + index % n_nodes + 1] = node;
    }
    let mut continued = |target: usize, from: [usize; 3]| {
        let [a, b, c] = from.map(|index| all[index]);
        all[target] = [0, 1].map(|k| 3.0 * (a[k] - b[k]) + c[k]);
    };
    for row in 1..=n_nodes {
        let start = row * width;
        continued(start, [start + 1, start + 2, start + 3]);
        let end = start + n_nodes + 1;
        continued(end, [end - 1, end - 2, end - 3]);
    }
    for column in 0..width {
        continued(column, [column + width, column + 2 * width, column + 3 * width]);
        let end = (n_nodes + 1) * width + column;
        continued(end, [end - width, end - 2 * width, end - 3 * width]);
    }
    all
}

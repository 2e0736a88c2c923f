//! Pieces of pixels that hang together.

/// Pixels that hang together, as sums over them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Piece {
    /// How many, and sums of x, y and their products.
    pub n: f64,
    /// See there.
    pub x: f64,
    /// See there.
    pub y: f64,
    /// See there.
    pub xx: f64,
    /// See there.
    pub xy: f64,
    /// See there.
    pub yy: f64,
    /// Smallest and greatest x and y.
    pub bounds: [usize; 4],
}

/// A run of pixels in a row.
#[derive(Clone, Copy)]
struct Run {
    from: usize,
    to: usize,
    piece: usize,
}

/// Pieces of pixels above the threshold that touch, corners included.
pub fn pieces(values: &[f32], width: usize, threshold: f32) -> Vec<Piece> {
    labelled(values, width, threshold, &mut |_, _| {}).into_iter().map(|(_, piece)| piece).collect()
}

/// Pieces as [`pieces`] finds them, and for each its runs of pixels row by row: y, first x, and
/// one beyond the last.
pub fn pieces_with_runs(
    values: &[f32],
    width: usize,
    threshold: f32,
) -> Vec<(Piece, Vec<[usize; 3]>)> {
    let mut runs: Vec<(usize, [usize; 3])> = Vec::new();
    let found = labelled(values, width, threshold, &mut |y, run| {
        runs.push((run.piece, [y, run.from, run.to]));
    });
    // A run's piece may have been joined to an older one since.
    let mut of_root: Vec<usize> = Vec::new();
    let mut all: Vec<(Piece, Vec<[usize; 3]>)> = Vec::with_capacity(found.len());
    for (labels, piece) in found {
        for label in labels {
            if of_root.len() <= label {
                of_root.resize(label + 1, usize::MAX);
            }
            of_root[label] = all.len();
        }
        all.push((piece, Vec::new()));
    }
    for (label, run) in runs {
        all[of_root[label]].1.push(run);
    }
    all
}

/// Every piece with the labels that its runs were given.
fn labelled(
    values: &[f32],
    width: usize,
    threshold: f32,
    seen: &mut dyn FnMut(usize, Run),
) -> Vec<(Vec<usize>, Piece)> {
    let mut parents: Vec<usize> = Vec::new();
    let mut sums: Vec<Piece> = Vec::new();
    let (mut above, mut here): (Vec<Run>, Vec<Run>) = (Vec::new(), Vec::new());
    for (y, row) in values.chunks_exact(width).enumerate() {
        here.clear();
        let mut x = 0;
        let mut first_above = 0;
        while x < width {
            if row[x] <= threshold {
                x += 1;
                continue;
            }
            let from = x;
            while x < width && row[x] > threshold {
                x += 1;
            }
            let (to, mut piece) = (x, usize::MAX);
            while first_above < above.len() && above[first_above].to < from {
                first_above += 1;
            }
            for run in above[first_above..].iter().take_while(|run| run.from <= to) {
                let other = root(&mut parents, run.piece);
                if piece == usize::MAX {
                    piece = other;
                } else if piece != other {
                    // The older one stays, so that the order is that of the picture.
                    let (old, young) = (piece.min(other), piece.max(other));
                    parents[young] = old;
                    let sum = sums[young];
                    sums[old].join(&sum);
                    piece = old;
                }
            }
            if piece == usize::MAX {
                piece = parents.len();
                parents.push(piece);
                sums.push(Piece { bounds: [from, from, y, y], ..Piece::default() });
            }
            sums[piece].join(&Piece::of_run(from, to, y));
            here.push(Run { from, to, piece });
            seen(y, Run { from, to, piece });
        }
        std::mem::swap(&mut above, &mut here);
    }
    let mut at_root = vec![usize::MAX; parents.len()];
    let mut all: Vec<(Vec<usize>, Piece)> = Vec::new();
    for label in 0..parents.len() {
        // The oldest label of a piece comes first.
        let root = root(&mut parents, label);
        if root == label {
            at_root[label] = all.len();
            all.push((Vec::new(), sums[label]));
        }
        all[at_root[root]].0.push(label);
    }
    all
}

/// The oldest piece that one was joined to.
fn root(parents: &mut [usize], mut piece: usize) -> usize {
    while parents[piece] != piece {
        parents[piece] = parents[parents[piece]];
        piece = parents[piece];
    }
    piece
}

impl Piece {
    fn of_run(from: usize, to: usize, y: usize) -> Self {
        let n = (to - from) as f64;
        let middle = 0.5 * (from + to - 1) as f64;
        let y_value = y as f64;
        Self {
            n,
            x: n * middle,
            y: n * y_value,
            xx: n * middle * middle + n * (n * n - 1.0) / 12.0,
            xy: n * middle * y_value,
            yy: n * y_value * y_value,
            bounds: [from, to - 1, y, y],
        }
    }

    fn join(&mut self, other: &Self) {
        self.n += other.n;
        self.x += other.x;
        self.y += other.y;
        self.xx += other.xx;
        self.xy += other.xy;
        self.yy += other.yy;
        let [a, b] = [self.bounds, other.bounds];
        self.bounds = [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])];
    }
}

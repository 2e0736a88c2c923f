//! Convex programs, solved by an interior-point method to the accuracy that a polish completes.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// Balancing and regularisation of the solver, in the order tried. With its own 1e-8 one robust
/// program in fifty stalls; with 1e-7 one in four hundred, most of which the others finish.
const ATTEMPTS: [(bool, f64); 3] = [(true, 1e-7), (true, 1e-8), (false, 1e-7)];
/// Feasibility and gap, in units of the largest values.
const TOLERANCE: f64 = 1e-9;

/// Rows and entries of a program under construction.
#[derive(Clone, Default)]
pub(crate) struct Rows {
    row: Vec<usize>,
    column: Vec<usize>,
    value: Vec<f64>,
    right: Vec<f64>,
}

impl Rows {
    /// Adds a row with these entries; those of value zero are left out.
    pub(crate) fn add(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, right: f64) {
        let row = self.right.len();
        for (column, value) in entries {
            if value != 0.0 {
                self.row.push(row);
                self.column.push(column);
                self.value.push(value);
            }
        }
        self.right.push(right);
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.right.len()
    }
}

/// The variables with the least sum of cost and half the squares of some of them; `None` if no
/// variables keep the rows; else the solver's status.
///
/// * `cones`: where the right sides minus the rows must lie, in the order of the rows
/// * `cost`: one for each variable
/// * `squared`: the variables whose squares count
pub(crate) fn minimise(
    rows: Rows,
    cones: &[SupportedConeT<f64>],
    cost: &[f64],
    squared: Vec<usize>,
) -> Result<Option<Vec<f64>>, String> {
    let Rows { row, column, value, right } = rows;
    let n_columns = cost.len();
    let a = CscMatrix::new_from_triplets(right.len(), n_columns, row, column, value);
    let ones = vec![1.0; squared.len()];
    let p = CscMatrix::new_from_triplets(n_columns, n_columns, squared.clone(), squared, ones);
    let mut ended = Err(String::new());
    for (equilibrate_enable, static_regularization_constant) in ATTEMPTS {
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            equilibrate_enable,
            static_regularization_constant,
            // What the goal is worth: the solver's own 1e-13 costs a tenth of the time.
            iterative_refinement_reltol: TOLERANCE,
            iterative_refinement_abstol: 0.1 * TOLERANCE,
            // More threads would only contend with the atlas's own.
            max_threads: 1,
            ..DefaultSettings::default()
        };
        let mut solver = DefaultSolver::new(&p, cost, &a, &right, cones, settings)
            .map_err(|error| error.to_string())?;
        solver.solve();
        let solution = solver.solution;
        match solution.status {
            SolverStatus::Solved => return Ok(Some(solution.x)),
            // The goal may be 5e-5 short; the polish that follows keeps all limits anyhow.
            SolverStatus::AlmostSolved => ended = Ok(Some(solution.x)),
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible
                if ended.is_err() =>
            {
                ended = Ok(None);
            }
            status if ended.is_err() => ended = Err(format!("{status:?}")),
            _ => {}
        }
    }
    ended
}

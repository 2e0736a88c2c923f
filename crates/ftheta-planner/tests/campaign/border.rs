//! Whether a route that was refused is impossible: programs of their own, each a relaxation.

use super::plant::{Flow, Motion, TICK_S};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT,
};
use ftheta_model::machine::Scanner;
use ftheta_planner::jump::Route;

/// Speeds of the tables, each larger than the last by this factor.
const RATIO: f64 = 1.06;
/// Smallest speed of the tables, rad/s.
const SPEED_MIN_RAD_S: f64 = 1.0;
/// They go beyond the greatest that is asked for by this factor, for chords on both sides.
const BEYOND: f64 = 1.2;
/// Part of the border within which an answer is counted apart.
const BORDER: f64 = 1e-3;
/// Most ticks of a direct way that are tried.
const N_TICKS_MAX: usize = 150;

/// What is to be said about a refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No motion within the angles does it.
    Right,
    /// Within a thousandth of what is possible, or of what the tables resolve.
    Border,
    /// There is one.
    Wrong,
}

/// What a program is for.
#[derive(Clone, Copy, Debug)]
enum Goal {
    /// Least angle ahead in which this speed, rad/s, is turned.
    Turn(f64),
    /// Least angle behind from which this speed is reached.
    RunUp(f64),
    /// Least part of voltage and current for this route.
    Pass(Route),
}

/// Least room of each speed to turn and to run up, of one scanner.
pub struct Border {
    scanner: Scanner,
    flow: Flow,
    speeds_rad_s: Vec<f64>,
    rooms_rad: [Vec<f64>; 2],
}

impl Border {
    /// Solves the tables up to a speed.
    pub fn new(scanner: &Scanner, speed_max_rad_s: f64) -> Self {
        let flow = Flow::new(scanner, TICK_S);
        let mut border = Self {
            scanner: scanner.clone(),
            flow,
            speeds_rad_s: Vec::new(),
            rooms_rad: Default::default(),
        };
        let mut speed = SPEED_MIN_RAD_S;
        while speed < BEYOND * speed_max_rad_s {
            let n_ticks = border.ample_ticks(speed);
            let rooms = [Goal::Turn(speed), Goal::RunUp(speed)]
                .map(|goal| border.solve(n_ticks, goal).unwrap_or(0.0));
            border.speeds_rad_s.push(speed);
            for (table, room) in border.rooms_rad.iter_mut().zip(rooms) {
                table.push(room);
            }
            speed *= RATIO;
        }
        border
    }

    /// Judges a refusal.
    pub fn verdict(&self, route: &Route) -> Verdict {
        let limit = self.scanner.angle_max_rad;
        let room = |angle: f64, speed: f64| limit - angle * 1.0_f64.copysign(speed);
        let ahead = room(route.from_rad, route.from_rad_s);
        let behind = room(-route.to_rad, route.to_rad_s);
        let turn = self.compare(0, route.from_rad_s.abs(), ahead);
        let run_up = self.compare(1, route.to_rad_s.abs(), behind);
        let detour = match (turn, run_up) {
            (Verdict::Right, _) | (_, Verdict::Right) => Verdict::Right,
            (Verdict::Wrong, Verdict::Wrong) => return Verdict::Wrong,
            _ => Verdict::Border,
        };
        match self.pass(route) {
            Verdict::Right => detour,
            other => other,
        }
    }

    /// Whether a room is too small for a speed: the least room is convex in the speed, so chords
    /// between neighbours are above it, and prolonged below.
    fn compare(&self, table: usize, speed_rad_s: f64, room_rad: f64) -> Verdict {
        let (speeds, rooms) = (&self.speeds_rad_s, &self.rooms_rad[table]);
        let next = speeds.partition_point(|&speed| speed < speed_rad_s);
        let chord = |low: usize, high: usize| {
            let share = (speed_rad_s - speeds[low]) / (speeds[high] - speeds[low]);
            rooms[low] + share * (rooms[high] - rooms[low])
        };
        if next < 2 || next + 1 >= speeds.len() {
            let enough = rooms.first().is_some_and(|&least| room_rad > least);
            return if enough { Verdict::Wrong } else { Verdict::Border };
        }
        let most = chord(next - 1, next);
        let least = chord(next - 2, next - 1).max(chord(next, next + 1));
        if room_rad < least * (1.0 - BORDER) {
            Verdict::Right
        } else if room_rad > most * (1.0 + BORDER) + self.between_ticks_rad() {
            Verdict::Wrong
        } else {
            Verdict::Border
        }
    }

    /// What the mirror may go beyond the angles that programs see at the ticks, rad.
    fn between_ticks_rad(&self) -> f64 {
        self.acceleration() * TICK_S * TICK_S / 8.0
    }

    /// The straight way, without turning: every number of ticks that a rigid axis could do it in.
    fn pass(&self, route: &Route) -> Verdict {
        let step = route.to_rad - route.from_rad;
        let (v0, v1) = (route.from_rad_s, route.to_rad_s);
        if v0 * v1 < 0.0 || step * (v0 + v1) < 0.0 {
            return Verdict::Right;
        }
        let acceleration = self.acceleration();
        // Where full braking meets full acceleration; slower is only possible by turning.
        let slowest = 0.5 * (v0 * v0 + v1 * v1) - acceleration * step.abs();
        let longest_s = match slowest > 0.0 {
            true => (v0.abs() + v1.abs() - 2.0 * slowest.sqrt()) / acceleration,
            false => N_TICKS_MAX as f64 * TICK_S,
        };
        let mut verdict = Verdict::Right;
        for n_ticks in 1..=N_TICKS_MAX.min((longest_s / TICK_S) as usize + 1) {
            let time_s = n_ticks as f64 * TICK_S;
            let reach = 0.5 * acceleration * time_s * time_s;
            let may = (step - v0 * time_s).abs() <= reach
                && (step - v1 * time_s).abs() <= reach
                && (v1 - v0).abs() <= acceleration * time_s;
            // Five states take five voltages.
            if !may || n_ticks < 5 {
                continue;
            }
            match self.solve(n_ticks, Goal::Pass(*route)) {
                Some(part) if part < 1.0 - BORDER => return Verdict::Wrong,
                Some(part) if part < 1.0 + BORDER => verdict = Verdict::Border,
                _ => {}
            }
        }
        verdict
    }

    fn acceleration(&self) -> f64 {
        let inertia = self.scanner.rotor_inertia_kg_m2 + self.scanner.mirror_inertia_kg_m2;
        self.scanner.torque_constant_n_m_a * self.scanner.current_max_a / inertia
    }

    fn ample_ticks(&self, speed_rad_s: f64) -> usize {
        let rise_s = self.scanner.inductance_h * self.scanner.current_max_a
            / self.scanner.voltage_max_v
            + 1.0 / self.scanner.torsional_mode_hz;
        ((1.5 * speed_rad_s / self.acceleration() + 3.0 * rise_s) / TICK_S) as usize + 8
    }

    /// The least of what the goal names; `None` if there is none.
    fn solve(&self, n_ticks: usize, goal: Goal) -> Option<f64> {
        let scanner = &self.scanner;
        let omega = std::f64::consts::TAU * scanner.torsional_mode_hz;
        let torque = scanner.torque_constant_n_m_a * scanner.current_max_a;
        let twist = torque / (scanner.rotor_inertia_kg_m2 * omega * omega);
        let (angle, speed) = match goal {
            Goal::Turn(v) | Goal::RunUp(v) => (v * v / self.acceleration(), v),
            Goal::Pass(_) => (0.01, 100.0),
        };
        let units = [angle, speed, twist, twist * omega, scanner.current_max_a];
        let mut program = Program { flow: self.flow, units, n_ticks, ..Program::default() };
        program.voltage_max_v = scanner.voltage_max_v;
        program.chain(match goal {
            Goal::Turn(v) => [0.0, v, 0.0, 0.0, 0.0],
            Goal::RunUp(_) => [0.0; 5],
            Goal::Pass(route) => [0.0, route.from_rad_s, 0.0, 0.0, 0.0],
        });
        match goal {
            Goal::Turn(_) => {}
            Goal::RunUp(v) => program.end([None, Some(v), Some(0.0), Some(0.0), Some(0.0)]),
            Goal::Pass(route) => {
                let (step, v) = (route.to_rad - route.from_rad, route.to_rad_s);
                program.end([Some(step), Some(v), Some(0.0), Some(0.0), Some(0.0)]);
            }
        }
        let n_equal = program.right.len();
        program.limits(matches!(goal, Goal::Pass(_)));
        let least = program.least();
        let end = program.state(n_ticks, 0);
        for tick in 1..=n_ticks {
            let place = program.state(tick, 0);
            match goal {
                Goal::Turn(_) => program.row(&[(place, 1.0), (least, -1.0)], 0.0),
                Goal::RunUp(_) => {
                    program.row(&[(end, 1.0), (place, -1.0), (least, -1.0)], 0.0);
                }
                Goal::Pass(route) => {
                    let limit = scanner.angle_max_rad;
                    program.row(&[(place, 1.0)], (limit - route.from_rad) / angle);
                    program.row(&[(place, -1.0)], (limit + route.from_rad) / angle);
                }
            }
        }
        match goal {
            Goal::Turn(_) => program.row(&[(program.state(n_ticks, 1), 1.0)], 0.0),
            Goal::RunUp(_) => program.row(&[(end, 1.0), (least, -1.0)], 0.0),
            Goal::Pass(_) => {}
        }
        let found = program.solve(n_equal)?;
        Some(if matches!(goal, Goal::Pass(_)) { found } else { found * angle })
    }
}

/// A linear program in voltages and states, and what is least.
#[derive(Default)]
struct Program {
    flow: Flow,
    units: Motion,
    voltage_max_v: f64,
    n_ticks: usize,
    entries: [Vec<usize>; 2],
    values: Vec<f64>,
    right: Vec<f64>,
}

impl Program {
    fn voltage(&self, tick: usize) -> usize {
        6 * tick
    }

    fn state(&self, tick: usize, index: usize) -> usize {
        6 * (tick - 1) + 1 + index
    }

    fn least(&self) -> usize {
        6 * self.n_ticks
    }

    fn row(&mut self, entries: &[(usize, f64)], right: f64) {
        for &(column, value) in entries {
            self.entries[0].push(self.right.len());
            self.entries[1].push(column);
            self.values.push(value);
        }
        self.right.push(right);
    }

    /// Each state follows from the one before.
    fn chain(&mut self, start: Motion) {
        let first = self.flow.after(&start, 0.0);
        for tick in 0..self.n_ticks {
            for (to, first) in first.into_iter().enumerate() {
                let unit = self.units[to];
                let gain = self.flow.voltage[to] * self.voltage_max_v / unit;
                let mut row = vec![(self.state(tick + 1, to), 1.0), (self.voltage(tick), -gain)];
                if tick > 0 {
                    row.extend((0..5).map(|from| {
                        let gain = self.flow.motion[to][from] * self.units[from] / unit;
                        (self.state(tick, from), -gain)
                    }));
                }
                self.row(&row, if tick > 0 { 0.0 } else { first / unit });
            }
        }
    }

    /// The states that the end must have.
    fn end(&mut self, states: [Option<f64>; 5]) {
        for (index, state) in states.into_iter().enumerate() {
            if let Some(value) = state {
                self.row(&[(self.state(self.n_ticks, index), 1.0)], value / self.units[index]);
            }
        }
    }

    /// Voltage and current at most all, or the part that is to be least.
    fn limits(&mut self, part: bool) {
        for tick in 0..self.n_ticks {
            for column in [self.voltage(tick), self.state(tick + 1, 4)] {
                for sign in [1.0, -1.0] {
                    match part {
                        true => self.row(&[(column, sign), (self.least(), -1.0)], 0.0),
                        false => self.row(&[(column, sign)], 1.0),
                    }
                }
            }
        }
    }

    fn solve(self, n_equal: usize) -> Option<f64> {
        let (n_rows, n_columns) = (self.right.len(), self.least() + 1);
        let least = self.least();
        let [rows, columns] = self.entries;
        let a = CscMatrix::new_from_triplets(n_rows, n_columns, rows, columns, self.values);
        let mut cost = vec![0.0; n_columns];
        cost[least] = 1.0;
        let cones = [ZeroConeT(n_equal), NonnegativeConeT(n_rows - n_equal)];
        let settings = DefaultSettings { verbose: false, max_threads: 1, ..Default::default() };
        let p = CscMatrix::zeros((n_columns, n_columns));
        let mut solver = DefaultSolver::new(&p, &cost, &a, &self.right, &cones, settings).ok()?;
        solver.solve();
        let solved =
            matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        solved.then(|| solver.solution.x[least])
    }
}

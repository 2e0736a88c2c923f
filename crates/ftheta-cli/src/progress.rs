//! Progress on a terminal, and how long each stage took.

use ftheta::mark::Stage;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// A bar on stderr if that is a terminal, and the clock of the stages.
pub struct Progress {
    bar: Option<ProgressBar>,
    started: Instant,
    stage: &'static str,
    stages: Vec<(&'static str, f64)>,
}

/// A bar appears only for what takes longer than this.
const PATIENCE: Duration = Duration::from_millis(500);

impl Progress {
    /// Starts the clock in a first stage.
    pub fn new(stage: &'static str) -> Self {
        Self { bar: None, started: Instant::now(), stage, stages: Vec::new() }
    }

    /// Takes note of a stage of the main job.
    pub fn observe(&mut self, stage: Stage) {
        let (name, share) = match stage {
            Stage::Lay => ("lay", 0.0),
            Stage::Atlas(share) => ("atlas", share),
            Stage::Plan => ("plan", 0.0),
            Stage::Audit => ("audit", 0.0),
            Stage::Play(share) => ("play", share),
            Stage::Finish => ("finish", 1.0),
            Stage::Tune(share) => ("tune", share),
        };
        self.enter(name);
        if self.bar.is_none() && std::io::stderr().is_terminal() && self.total() > PATIENCE {
            self.bar = Some(bar());
        }
        if let Some(bar) = &self.bar {
            bar.set_message(name);
            bar.set_position((share * 1000.0) as u64);
        }
    }

    /// Begins a stage, unless it is the present one.
    pub fn enter(&mut self, stage: &'static str) {
        if stage == self.stage {
            return;
        }
        let elapsed = self.started.elapsed();
        self.stages.push((self.stage, elapsed.as_secs_f64()));
        self.stage = stage;
        self.started = Instant::now();
    }

    fn total(&self) -> Duration {
        let before: f64 = self.stages.iter().map(|(_, time_s)| time_s).sum();
        Duration::from_secs_f64(before) + self.started.elapsed()
    }

    /// Ends the last stage; time of every stage in order, s.
    pub fn finish(mut self) -> Vec<(&'static str, f64)> {
        self.enter("");
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        self.stages
    }
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:8} {bar:40} {percent:>3} % {elapsed}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(1000).with_style(style)
}

//! The loop around a trainer: metrics, checkpoints, progress, and an orderly stop.
//!
//! [`train`] makes a run in a folder of its own, [`resume`] goes on with one. Worlds may be any; nothing is printed: what a person
//! may want to see while waiting goes to an [`Observer`].

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use serde::Serialize;

use crate::{
    apart::{Apart, PATIENCE},
    config::Config,
    error::{Result, RunError},
    provenance::{Provenance, Versions},
    run_folder::{
        Completeness, InitialWeights, Resumption, RunFolder, Status, StoredRun, WhichWeights,
        latest_row,
    },
    stop_request::StopRequest,
    training::{Checkpoint, MetricRow, Score, Teams, Trainer, assembly::RunWorld, headline},
};

/// Most bytes of a checkpoint that is still written when a stop was asked for: a second or two.
const QUICKLY_WRITTEN: usize = 256 << 20;

/// How a run stands.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Standing {
    /// Environment steps played.
    pub steps_env: u64,
    /// Environment steps to play, > 0.
    pub steps_env_total: u64,
    /// Share of battles won in the latest greedy test, in [0, 1], if there was one.
    pub battle_won_mean: Option<f64>,
    /// Share of the chosen pairs that delegated, in [0, 1], if there are pairs.
    pub delegation_rate: Option<f64>,
}

/// What is told while a run goes on. The unit type listens to nothing.
pub trait Observer {
    /// The run begins, or goes on, here.
    fn begin(&mut self, _standing: &Standing) {}

    /// The run has come so far; told after every update and every test.
    fn progress(&mut self, _standing: &Standing) {}

    /// Something is not as expected, and the run goes on all the same.
    fn warn(&mut self, _message: &str) {}

    /// The run has ended, well or not.
    fn end(&mut self) {}
}

impl Observer for () {}

/// What a finished run says of itself.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Where the run lies.
    pub folder: PathBuf,
    /// Environment steps played.
    pub steps_env: u64,
    /// Seconds that training took, since it began or was resumed.
    pub wall_s: f64,
    /// Environment steps a second in that time, everything included.
    pub steps_per_s: f64,
    /// Share of battles won in the last greedy test, in [0, 1], if the world counts them.
    pub battle_won_mean: Option<f64>,
    /// What each test of this process gave, in order: the mean that says best how well a team plays in its world.
    #[serde(skip)]
    pub tests: Vec<f64>,
    /// How the last weights and the best play in episodes that neither training nor tests have seen.
    pub teams: Teams,
}

/// Makes the run that `config` describes, in `world`, and keeps metrics, checkpoints, status and weights (the last, the best, and
/// others if the configuration asks for them) in a new folder at `path`.
///
/// # Errors
/// [`RunError::Interrupted`] when asked to stop, after a checkpoint; [`RunError::FolderInUse`], [`RunError::UnfinishedRun`] or
/// [`RunError::FolderLocked`] if something lies at `path`, before anything is written; otherwise what went wrong.
pub fn train(
    path: &Path,
    config: &Config,
    world: &RunWorld,
    threads: usize,
    stop: &StopRequest,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    train_from(path, config, None, world, threads, stop, observer)
}

/// As [`train`]; with `initial`, of a team that begins with the weights of another run, of which `config` has the hash.
///
/// # Errors
/// As [`train`], and [`mackrl::Error::Data`] if the weights are not those of such a team.
pub fn train_from(
    path: &Path,
    config: &Config,
    initial: Option<&InitialWeights>,
    world: &RunWorld,
    threads: usize,
    stop: &StopRequest,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    RunFolder::check_free(path)?;
    let made = {
        let (own, world, asked) = (config.clone(), world.clone(), stop.clone());
        let weights = initial.map(|initial| initial.bytes.clone());
        let make = move || -> Result<_> {
            let trainer = beginning(weights.as_deref(), &own, &world, threads)?;
            Ok(Reporting::new(trainer, &own, &asked))
        };
        Apart::start(make, stop)
    };
    let Ok(training) = made else {
        // Nothing is made yet, and the run can go on from there.
        let mut folder = RunFolder::create_from(path, config, initial, threads)?;
        folder.set_status(Status::Interrupted)?;
        return Err(interrupted(path, 0));
    };
    let mut training = training?;
    let mut folder = RunFolder::create_from(path, config, initial, threads)?;
    train_into(&mut folder, &mut training, config, stop, observer)
}

/// Continues the run at `path` to its end, in what `world` makes of its configuration; gives nothing if it is there already. From
/// its latest intact checkpoint on it is as if it had never stopped.
///
/// # Errors
/// [`RunError::Interrupted`] when asked to stop; otherwise what went wrong.
pub fn resume(
    path: &Path,
    world: impl FnOnce(&Config) -> Result<RunWorld, mackrl::Error>,
    threads: usize,
    stop: &StopRequest,
    observer: &mut dyn Observer,
) -> Result<Option<Summary>> {
    match StoredRun::open(path)?.completeness()? {
        Completeness::Finished => return Ok(None),
        Completeness::WithoutWeights => observer.warn(&format!(
            "{} was finished, and its weights are lost or damaged since: its last checkpoint gives them again",
            path.display()
        )),
        Completeness::Unfinished => {}
    }
    let Resumption {
        mut folder,
        config,
        checkpoint,
        initial,
        damaged,
        metrics_put_aside,
        weights_lost,
        earlier,
    } = RunFolder::resume(path, threads)?;
    for damage in damaged {
        observer.warn(&format!("{damage}; an earlier one is used"));
    }
    if let Some(aside) = metrics_put_aside {
        observer.warn(&format!(
            "the metrics are not those of the checkpoint: what is left of them is put aside as {}, and no rows before this point are known any more",
            aside.display()
        ));
    }
    for weights in weights_lost {
        observer.warn(&format!(
            "{weights} is lost or damaged, and not kept any more"
        ));
    }
    if let Some(earlier) = earlier {
        observer.warn(&format!(
            "the run was made by {earlier} and goes on with {}: it may not be what either of them makes alone",
            Versions::OWN
        ));
    }
    let world = world(&config)?;
    let made = {
        let (own, asked) = (config.clone(), stop.clone());
        let make = move || -> Result<_> {
            let trainer = match checkpoint {
                Some(checkpoint) => Trainer::resumed(&own, &world, threads, &checkpoint)?,
                None => beginning(initial.as_deref(), &own, &world, threads)?,
            };
            Ok(Reporting::new(trainer, &own, &asked))
        };
        Apart::start(make, stop)
    };
    let Ok(training) = made else {
        folder.set_status(Status::Interrupted)?;
        return Err(interrupted(path, latest_row(path).steps_env));
    };
    train_into(&mut folder, &mut training?, &config, stop, observer).map(Some)
}

/// A trainer of a run at its beginning.
fn beginning(
    initial: Option<&[u8]>,
    config: &Config,
    world: &RunWorld,
    threads: usize,
) -> Result<Trainer, mackrl::Error> {
    match initial {
        Some(weights) => Trainer::beginning_with(weights, config, world, threads),
        None => Trainer::in_world(config, world, threads),
    }
}

/// That the run at `path` was asked to stop.
fn interrupted(path: &Path, steps_env: u64) -> RunError {
    let folder = path.to_owned();
    RunError::Interrupted { folder, steps_env }
}

/// Trains to the end, or until asked to stop.
fn train_into<T: Training>(
    folder: &mut RunFolder,
    training: &mut Apart<T>,
    config: &Config,
    stop: &StopRequest,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let outcome = continue_into(folder, training, config, stop, observer);
    observer.end();
    let recorded = match &outcome {
        Ok(summary) => folder.finish(summary.teams.clone()),
        Err(error) if error.is_interruption() => folder.set_status(Status::Interrupted),
        Err(error) => folder.set_failed(error.chain()),
    };
    // What stopped the training matters more than a status that cannot be written.
    let summary = outcome?;
    recorded?;
    Ok(summary)
}

/// A run's checkpoint as it was before an update that may have to be given up.
struct Snapshot {
    iterations: u64,
    checkpoint: Checkpoint,
}

impl Snapshot {
    fn of(training: &impl Training) -> Self {
        Self {
            iterations: training.iterations(),
            checkpoint: training.checkpoint(),
        }
    }

    /// Writes it, unless that takes too long when a stop was asked for: then the run goes on from the checkpoint before.
    fn write_in_time(&self, folder: &mut RunFolder) -> Result<()> {
        let Checkpoint {
            tensors,
            counters,
            best,
            ..
        } = &self.checkpoint;
        let best = best.as_ref().map_or(0, Vec::len);
        if tensors.len() + counters.len() + best > QUICKLY_WRITTEN {
            return Ok(());
        }
        folder.write_checkpoint(self.iterations, &self.checkpoint)
    }
}

fn continue_into<T: Training>(
    folder: &mut RunFolder,
    training: &mut Apart<T>,
    config: &Config,
    stop: &StopRequest,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let start = Instant::now();
    let mut standing = training.complete(|training| training.standing());
    observer.begin(&standing);
    let steps_env_before = standing.steps_env;
    if config.run.tensorboard {
        folder.write_events(steps_env_before)?;
    }
    let interval = config.run.checkpoint_interval_steps_env;
    let mut intervals = steps_env_before / interval;
    let mut snapshot: Option<Snapshot> = None;
    let mut tests = Vec::new();
    while !training.complete(|training| training.finished()) {
        if stop.is_made() {
            if let Ok(snapshot) = training.ask(stop, |training| Snapshot::of(training)) {
                snapshot.write_in_time(folder)?;
            }
            return Err(interrupted(folder.path(), standing.steps_env));
        }
        let began = Instant::now();
        let Ok(update) = training.ask(stop, |training| training.update()) else {
            if let Some(snapshot) = &snapshot {
                Snapshot::write_in_time(snapshot, folder)?;
            }
            return Err(interrupted(folder.path(), standing.steps_env));
        };
        let (metrics, kept) = match update {
            // What was begun was given up; the checkpoint is that of the moment before.
            Err(mackrl::Error::Stopped) => continue,
            Err(mackrl::Error::NotFinite(number)) => {
                return Err(RunError::UpdateRefused {
                    number,
                    folder: folder.path().to_owned(),
                });
            }
            outcome => {
                let update = outcome?;
                standing = update.standing;
                tests.extend(update.tested);
                (update.metrics, update.kept)
            }
        };
        if let Some(metrics) = metrics {
            folder.append_metrics(&metrics)?;
        }
        for (which, weights) in kept {
            folder.write_weights(which, &weights)?;
        }
        observer.progress(&standing);
        if standing.steps_env / interval > intervals {
            intervals = standing.steps_env / interval;
            let Snapshot {
                iterations,
                checkpoint,
            } = training.complete(|training| Snapshot::of(training));
            folder.write_checkpoint(iterations, &checkpoint)?;
        }
        // The next update may take as long, and have to be given up.
        snapshot = if began.elapsed() < PATIENCE / 2 {
            None
        } else {
            training.ask(stop, |training| Snapshot::of(training)).ok()
        };
    }
    let (last, weights) =
        training.complete(|training| (Snapshot::of(training), training.weights()));
    folder.write_checkpoint(last.iterations, &last.checkpoint)?;
    folder.write_weights(WhichWeights::Last, &weights)?;
    let teams = match training.ask(stop, |training| training.judge()) {
        Ok(Err(mackrl::Error::Stopped)) | Err(_) => {
            return Err(interrupted(folder.path(), standing.steps_env));
        }
        Ok(teams) => teams?,
    };
    let wall_s = start.elapsed().as_secs_f64();
    let steps_env = standing.steps_env;
    Ok(Summary {
        folder: folder.path().to_owned(),
        steps_env,
        wall_s,
        steps_per_s: (steps_env - steps_env_before) as f64 / wall_s.max(1e-9),
        battle_won_mean: standing.battle_won_mean,
        tests,
        teams,
    })
}

/// What one update gave.
#[derive(Debug, Clone, PartialEq)]
struct Update {
    /// A row of metrics as one JSON object, without a line break, if one was due.
    metrics: Option<String>,
    /// How the run stands.
    standing: Standing,
    /// What a test gave, if it was one.
    tested: Option<f64>,
    /// Weights that are to be kept.
    kept: Vec<(WhichWeights, Vec<u8>)>,
}

/// Something that learns from one batch of episodes after the other.
trait Training: Send + 'static {
    /// Plays and learns from one batch.
    fn update(&mut self) -> Result<Update, mackrl::Error>;
    /// Whether the configured number of steps has been played.
    fn finished(&self) -> bool;
    /// How the run stands.
    fn standing(&self) -> Standing;
    /// Updates and tests so far, the same number at the same point of every repetition.
    fn iterations(&self) -> u64;
    /// Everything that the rest of the run depends on.
    fn checkpoint(&self) -> Checkpoint;
    /// The weights as safetensors, with what they are.
    fn weights(&self) -> Vec<u8>;
    /// How the last weights and the best play.
    fn judge(&mut self) -> Result<Teams, mackrl::Error>;
}

/// A trainer, and what it last reported.
struct Reporting {
    trainer: Trainer,
    standing: Standing,
    provenance: String,
    /// Environment steps between two weights that are kept, or 0.
    weights_interval: u64,
    /// The metric that says best how well the team plays.
    headline: String,
}

impl Reporting {
    /// A trainer of the run that `config` describes, at its beginning or restored, that gives up when asked to stop.
    fn new(mut trainer: Trainer, config: &Config, stop: &StopRequest) -> Self {
        trainer.stop_when(stop.flag());
        let headline = headline(trainer.spec());
        let standing = Standing {
            steps_env: trainer.steps_env(),
            steps_env_total: config.run.steps_env,
            ..Standing::default()
        };
        Self {
            trainer,
            standing,
            provenance: Provenance::of_run(config).id,
            weights_interval: config.run.weights_interval_steps_env,
            headline,
        }
    }

    /// The weights that are to be kept after an update or a test that began with so many environment steps.
    fn kept(
        &self,
        steps_env_before: u64,
        best_before: Option<Score>,
    ) -> Vec<(WhichWeights, Vec<u8>)> {
        let mut kept = Vec::new();
        if let Some((score, weights)) = self.trainer.best()
            && best_before != Some(*score)
        {
            kept.push((WhichWeights::Best, weights.to_owned()));
        }
        let reached = |steps_env: u64| steps_env.checked_div(self.weights_interval).unwrap_or(0);
        let now = reached(self.trainer.steps_env());
        if now > reached(steps_env_before) {
            let which = WhichWeights::Step(now * self.weights_interval);
            kept.push((which, self.trainer.described_weights()));
        }
        kept
    }
}

impl Training for Reporting {
    fn update(&mut self) -> Result<Update, mackrl::Error> {
        let steps_env_before = self.trainer.steps_env();
        let best_before = self.trainer.best().map(|(score, _)| *score);
        let row = self.trainer.update()?;
        self.standing.steps_env = self.trainer.steps_env();
        if let Some(row) = &row {
            let latest = |name, before| row.get(name).or(before);
            let Standing {
                battle_won_mean,
                delegation_rate,
                ..
            } = self.standing;
            self.standing.battle_won_mean = latest("test_battle_won_mean", battle_won_mean);
            self.standing.delegation_rate = latest("mackrl/delegation_rate", delegation_rate);
        }
        let tested = row.as_ref().and_then(|row| row.get(&self.headline));
        let metrics = row.map(|metrics| Row {
            metrics,
            provenance: &self.provenance,
        });
        let json = |row: Row<'_>| serde_json::to_string(&row).expect("numbers can be written");
        Ok(Update {
            metrics: metrics.map(json),
            standing: self.standing,
            tested,
            kept: self.kept(steps_env_before, best_before),
        })
    }

    fn finished(&self) -> bool {
        self.trainer.finished()
    }

    fn standing(&self) -> Standing {
        self.standing
    }

    fn iterations(&self) -> u64 {
        self.trainer.iterations()
    }

    fn checkpoint(&self) -> Checkpoint {
        self.trainer.checkpoint()
    }

    fn weights(&self) -> Vec<u8> {
        self.trainer.described_weights()
    }

    fn judge(&mut self) -> Result<Teams, mackrl::Error> {
        self.trainer.judge()
    }
}

/// A line of `metrics.jsonl`.
#[derive(Debug, Serialize)]
struct Row<'a> {
    #[serde(flatten)]
    metrics: MetricRow,
    /// Id of the provenance, which stands in `run.json`.
    provenance: &'a str,
}

#[cfg(test)]
mod tests;

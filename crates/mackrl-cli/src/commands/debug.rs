//! `mackrl debug`: an update that was refused, once more.

use std::{
    io::{self, Write},
    path::PathBuf,
};

use anyhow::Context;
use mackrl::NotFinite;
use mackrl_run::training::{Examination, Part, TensorStatistics, Trainer};
use serde::Serialize;

use crate::{
    args::DebugArgs,
    failure::Failure,
    output,
    provenance::{CODE, Provenance},
    run_folder::Dump,
};

/// What the repetition of an update showed.
#[derive(Debug, Serialize)]
struct Report {
    dump: PathBuf,
    provenance: Provenance,
    /// Why the update was refused.
    recorded: NotFinite,
    /// Why it is refused now, if it is.
    repeated: Option<NotFinite>,
    /// Whether it is refused for the same number at the same place.
    reproduced: bool,
    /// The first tensor that is not finite.
    origin: Option<TensorStatistics>,
    /// All tensors, in the order of computation.
    tensors: Vec<TensorStatistics>,
}

/// Repeats the update of a dump and shows where its number comes from.
pub(crate) fn run(args: &DebugArgs) -> anyhow::Result<()> {
    let dump = Dump::open(&args.dump)?;
    let made_by = &dump.refusal.provenance.code;
    if made_by != CODE {
        // The update may go another way; whoever reads on knows why.
        let _ = writeln!(
            io::stderr(),
            "warning: the update was refused by code {made_by} and is repeated with {CODE}"
        );
    }
    let mut trainer = Trainer::new(&dump.config, args.threads.count())?;
    trainer
        .restore(&dump.before)
        .with_context(|| format!("cannot use {}", dump.path.display()))?;
    let report = Report::new(dump, trainer.examine()?);
    if args.json {
        output::print_json(&report)?;
    } else {
        output::print(&report.text())?;
    }
    report.verdict()
}

impl Report {
    fn new(dump: Dump, examination: Examination) -> Self {
        let recorded = dump.refusal.number;
        Self {
            dump: dump.path,
            provenance: dump.refusal.provenance,
            reproduced: examination.refused.as_ref() == Some(&recorded),
            recorded,
            origin: examination.origin().cloned(),
            repeated: examination.refused,
            tensors: examination.tensors,
        }
    }

    fn text(&self) -> String {
        let repeated = match &self.repeated {
            _ if self.reproduced => "the same".to_owned(),
            Some(number) => number.to_string(),
            None => "all numbers are finite".to_owned(),
        };
        let origin = self.origin.as_ref().map_or_else(
            || "nowhere: every tensor is finite".to_owned(),
            |tensor| format!("in {}: {}{}", name(tensor.part), tensor.name, place(tensor)),
        );
        let rows = [
            ["dump", &self.dump.display().to_string()],
            ["recorded", &self.recorded.to_string()],
            ["repeated", &repeated],
            ["arises", &origin],
        ];
        let facts = rows.map(|[name, value]| format!("{name:<8}  {value}\n"));
        facts.concat() + "\n" + &self.table()
    }

    /// All tensors but those that were there, finite, before the update; these are in the JSON object.
    fn table(&self) -> String {
        let heading = ["tensor", "part", "numbers", "not finite", "min", "max"];
        let mut rows = vec![heading.map(str::to_owned).to_vec()];
        let interesting =
            |tensor: &&TensorStatistics| tensor.part != Part::Before || tensor.not_finite > 0;
        for tensor in self.tensors.iter().filter(interesting) {
            let number = |number: Option<f32>| {
                number.map_or_else(String::new, |number| format!("{number:.3e}"))
            };
            let is_origin = self.origin.as_ref() == Some(tensor);
            rows.push(vec![
                tensor.name.clone(),
                name(tensor.part),
                tensor.count.to_string(),
                tensor.not_finite.to_string(),
                number(tensor.min),
                number(tensor.max),
                if is_origin { "<- first" } else { "" }.to_owned(),
            ]);
        }
        output::table(&rows)
    }

    fn verdict(&self) -> anyhow::Result<()> {
        if self.reproduced {
            return Ok(());
        }
        let message = match &self.repeated {
            Some(number) => format!("the update is refused for another number: {number}"),
            None => "the update is not refused any more".to_owned(),
        };
        Err(Failure::NotReproduced { message }.into())
    }
}

/// A part of an update as JSON names it.
fn name(part: impl Serialize) -> String {
    let json = serde_json::to_value(part).unwrap_or_default();
    json.as_str().unwrap_or_default().to_owned()
}

fn place(tensor: &TensorStatistics) -> String {
    let axes = tensor.first.iter().flatten();
    let axes: Vec<String> = axes
        .map(|(axis, index)| format!("{axis} {index}"))
        .collect();
    if axes.is_empty() {
        String::new()
    } else {
        format!(", first at {}", axes.join(", "))
    }
}

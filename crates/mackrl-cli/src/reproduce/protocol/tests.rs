use std::fs;

use mackrl_run::{recorded::KEPT, sweep::Entry};

use super::*;
use crate::reproduce::Verdict;

const PLAN: &str = r#"
preset = "paper-code"
maps = ["2s3z"]
algorithms = ["mackrl", "central-v"]
seeds = [101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 112, 113, 114, 115, 116]

[settings]
run.steps_env = 2500000
run.metrics_interval_steps_env = 25000
test.interval_steps_env = 25000

[variants.one-sweep]

[variants.gae]
algorithm.advantage_lambda = 0.8
"#;

/// A folder with a plan and kept runs that win `won` of every test but the first, a thousandth more with each seed; nothing where
/// that is nothing.
fn folder(won: impl Fn(&str) -> Option<f64>) -> tempfile::TempDir {
    kept(PLAN, |entry| {
        let (kind, seed) = entry.name.split_once("-seed").unwrap();
        let seed: f64 = seed.parse().unwrap();
        Some(won(kind)? + (seed - 108.5) / 1000.0)
    })
}

/// A folder with `plan` and kept runs that win `won` of every test but the first; nothing where that is nothing.
fn kept(plan: &str, won: impl Fn(&Entry) -> Option<f64>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plan-2s3z.toml"), plan).unwrap();
    fs::create_dir(folder.path().join(KEPT)).unwrap();
    for entry in plans(folder.path(), None).unwrap().remove(0).entries {
        let Some(won) = won(&entry) else {
            continue;
        };
        let tests = entry.config.run.steps_env / entry.config.test.interval_steps_env;
        let later = (0..tests).map(|_| won);
        let tests = std::iter::once(0.0).chain(later).collect();
        let run = mackrl_run::recorded::TrainingRun::new(&entry.config, tests, Vec::new());
        let file = folder.path().join(KEPT).join(entry.name + ".json");
        fs::write(file, serde_json::to_string(&run).unwrap()).unwrap();
    }
    folder
}

fn report(folder: &tempfile::TempDir) -> ProtocolReport {
    let options = ProtocolOptions {
        folder: folder.path().to_owned(),
        runs: Some(folder.path().join("nowhere")),
        mix: false,
        json: false,
    };
    run(&options).unwrap()
}

fn verdicts(judged: &Judged) -> Vec<Verdict> {
    let claims = judged.claims.iter();
    claims.map(|claim| claim.judgement.verdict).collect()
}

#[test]
fn the_configuration_in_which_both_together_win_most_is_judged_first() {
    let folder = folder(|kind| match kind {
        "2s3z-mackrl-one-sweep" => Some(0.9),
        "2s3z-central-v-one-sweep" => Some(0.2),
        "2s3z-mackrl-gae" => Some(0.7),
        _ => Some(0.6),
    });
    let report = report(&folder);
    assert_eq!(report.chosen.as_deref(), Some("gae"));
    assert_eq!(report.verdicts[0].configuration, "gae");
    use Verdict::{Holds, NotTested};
    let expected = [
        Holds, // over training
        Holds, // steps to one half
        Holds, // at the end
        Holds, // at a million, intervals apart
        Holds, // level
        Holds, // none below one half
        NotTested, NotTested, NotTested,
    ];
    assert_eq!(verdicts(&report.verdicts[0]), expected);
    let best = &report.verdicts[2];
    assert!(
        best.configuration
            .contains("mackrl one-sweep and central-v gae"),
        "{}",
        best.configuration
    );
    let text = fs::read_to_string(folder.path().join("report.txt")).unwrap();
    assert!(text.contains("Verdicts for gae (chosen)"), "{text}");
    assert!(folder.path().join("figure6-2s3z-gae.svg").is_file());
}

#[test]
fn a_claim_is_not_tested_while_a_run_is_missing() {
    let folder = folder(|kind| (kind != "2s3z-central-v-gae").then_some(0.5));
    let report = report(&folder);
    assert_eq!(report.chosen, None);
    assert_eq!(report.verdicts[0].configuration, "one-sweep");
    assert_eq!(verdicts(&report.verdicts[0])[0], Verdict::DoesNotHold);
    let gae = &report.verdicts[1];
    assert!(
        verdicts(gae)
            .iter()
            .all(|verdict| *verdict == Verdict::NotTested)
    );
    let evidence = &gae.claims[0].judgement.evidence;
    assert!(
        evidence.contains("central-v on 2s3z: 0 of 2500000 steps"),
        "{evidence}"
    );
}

/// The plans are data that is committed: all of their runs can be made, and each claim has its cells.
#[test]
fn the_plans_of_the_protocol_have_what_its_claims_are_about() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../results/protocol");
    if !folder.is_dir() {
        // Not in the packaged crate.
        return;
    }
    let study = Study::read(&folder, Some(Path::new("nowhere"))).unwrap();
    let planned = |map: &str| -> usize {
        let cells = study.cells.iter().filter(|cell| cell.map == map);
        cells.map(|cell| cell.planned).sum()
    };
    assert_eq!([planned("2s3z"), planned("3m")], [96, 3 * 32]);
    let ablations = Study::read(&folder.join("ablations"), Some(Path::new("nowhere"))).unwrap();
    for (study, claims) in [(&study, CLAIMS), (&ablations, ABLATIONS)] {
        for configuration in study.configurations() {
            for statement in claims {
                let evidence = statement.judge(study, &configuration).evidence;
                assert!(!evidence.contains("no plan"), "{evidence}");
            }
        }
    }
}

/// Ablations of few runs: a panel for each but MACKRL itself, with what it wins less or more than MACKRL.
#[test]
fn ablations_are_drawn_beside_mackrl() {
    let plan = r#"
preset = "paper-code"
maps = ["2s3z"]
algorithms = ["mackrl"]
seeds = 2

[settings]
run.steps_env = 50000
run.metrics_interval_steps_env = 25000
test.interval_steps_env = 25000

[variants.gae-learned]

[variants.gae-always]
algorithm.delegation = "always"

[variants.gae-never]
algorithm.delegation = "never"
"#;
    let folder = kept(plan, |entry| {
        let always = entry.name.contains("always");
        Some(if always { 0.25 } else { 0.5 })
    });
    let report = report(&folder);
    assert_eq!(
        verdicts(&report.verdicts[0]),
        [Verdict::NotTested; 7],
        "two runs are too few"
    );
    let svg = fs::read_to_string(folder.path().join("ablations-2s3z-gae.svg")).unwrap();
    assert_eq!(svg.matches("<clipPath").count(), 2);
    for told in [
        "mackrl always",
        "−0.250 [−0.250, −0.250]",
        "mackrl never",
        "0.000 [0.000, 0.000]",
    ] {
        assert!(svg.contains(told), "{told} in {svg}");
    }
}

use std::{fs, num::NonZeroUsize};

use clap::Parser;

use super::*;
use crate::reproduce::Claim;
use crate::reproduce::Verdict;

#[derive(Parser)]
struct CommandLine {
    #[command(flatten)]
    options: Figure5Options,
}

fn options(arguments: &[&str]) -> Figure5Options {
    let arguments = ["figure5"].iter().chain(arguments);
    CommandLine::try_parse_from(arguments)
        .expect("valid arguments")
        .options
}

fn report(arguments: &[&str]) -> Figure5Report {
    compute(&options(arguments), &|_, _| ()).expect("nothing is written")
}

fn verdict<'a>(report: &'a Figure5Report, beginning: &str) -> &'a Claim {
    let found = report
        .claims
        .iter()
        .find(|claim| claim.claim.starts_with(beginning));
    found.expect("the claim is judged")
}

#[test]
fn the_json_has_the_documented_keys_and_lengths() {
    for observation in ["2018", "neurips"] {
        let report = report(&["--runs", "2", "--observation", observation]);
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["payoffs"], "coded");
        assert_eq!(json["points"].as_array().unwrap().len(), 11);
        for learner in ["iac", "jal", "mackrl"] {
            for part in ["mean", "sem"] {
                let curve = json["curves"][learner][part].as_array().unwrap();
                assert_eq!(curve.len(), 11, "{learner} {part}");
            }
            let points = json["published"]["points"].as_array().unwrap().len();
            assert_eq!(json["published"][learner].as_array().unwrap().len(), points);
        }
        for class in ["decentralised", "jal", "mackrl", "oracle"] {
            assert_eq!(
                json["optimum"][class].as_array().unwrap().len(),
                11,
                "{class}"
            );
        }
        for claim in json["claims"].as_array().unwrap() {
            assert!(
                claim["claim"].is_string() && claim["evidence"].is_string(),
                "{claim}"
            );
            assert!(claim["verdict"].is_string(), "{claim}");
        }
        assert_eq!(
            serde_json::from_value::<Figure5Report>(json).unwrap(),
            report
        );
    }
}

#[test]
fn files_are_the_same_bytes_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let run_with = |threads: usize| {
        let out = folder.path().join(threads.to_string());
        let options = Figure5Options {
            out: out.clone(),
            runs: 3,
            threads: NonZeroUsize::new(threads),
            ..options(&[])
        };
        run(&options, &|_, _| ()).unwrap();
        ["figure5.json", "figure5.svg", "figure5.png"].map(|name| fs::read(out.join(name)).unwrap())
    };
    let files = run_with(1);
    assert!(files == run_with(5), "the number of threads changed a file");
    assert!(files[1].starts_with(b"<svg"), "not an SVG");
    assert!(files[2].starts_with(b"\x89PNG\r\n\x1a\n"), "not a PNG");
}

#[test]
fn verdicts_are_those_that_the_numbers_support() {
    let report = report(&["--runs", "100"]);
    for (beginning, holds) in [
        ("Without common knowledge (p = 0), MACKRL reproduces", false),
        (
            "Without common knowledge, joint-action learning fails",
            true,
        ),
        ("With common knowledge always available", true),
        ("On average, MACKRL delegates", true),
        ("It does so whenever", false),
        (
            "What MACKRL learns corresponds to the optimal policy",
            false,
        ),
        ("The best returns are exactly", true),
    ] {
        let claim = verdict(&report, beginning);
        let expected = Verdict::of(holds);
        assert_eq!(
            claim.verdict, expected,
            "{}: {}",
            claim.claim, claim.evidence
        );
    }
    let first = verdict(&report, "Without common knowledge (p = 0)");
    assert!(
        first.evidence.contains("0.621 against 0.654"),
        "{}",
        first.evidence
    );
}

#[test]
fn few_runs_judge_nothing_that_is_learnt() {
    let claims = report(&["--runs", "29"]).claims;
    let (last, others) = claims.split_last().unwrap();
    assert_eq!(
        last.verdict,
        Verdict::Holds,
        "optima are computed, not learnt"
    );
    for claim in others {
        assert_eq!(claim.verdict, Verdict::NotTested, "{}", claim.claim);
        assert!(
            claim.evidence.ends_with("there are 29."),
            "{}",
            claim.evidence
        );
    }
}

#[test]
fn the_published_figure_was_not_made_with_the_printed_payoffs() {
    let claim = "Every published point";
    let printed = report(&["--runs", "100", "--payoffs", "printed"]);
    let met = verdict(&printed, claim);
    assert_eq!(met.verdict, Verdict::DoesNotHold, "{}", met.evidence);
    let printed_iac = printed.curves.iac.mean[0] - printed.published.iac[0];
    assert!(
        printed_iac > 3.0 * printed.curves.iac.sem[0],
        "IAC at p = 0: +{printed_iac}"
    );
}

#[test]
fn delegation_is_reported_only_where_its_state_occurs() {
    let delegation = report(&["--runs", "2"]).delegation;
    assert!(delegation.matrix_a.mean[0].is_none() && delegation.matrix_b.mean[0].is_none());
    assert!(delegation.nothing.mean[0].is_some() && delegation.matrix_a.mean[1].is_some());
    assert!(delegation.nothing.mean[10].is_none());
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "here already").unwrap();
    let options = Figure5Options {
        out: file.join("figure5"),
        ..options(&["--runs", "2"])
    };
    let error = run(&options, &|_, _| panic!("work began")).unwrap_err();
    assert!(
        format!("{error:#}").contains("creating the folder"),
        "{error:#}"
    );
    assert_eq!(fs::read_to_string(&file).unwrap(), "here already");
}

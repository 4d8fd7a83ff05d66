//! The paper's claims about Figure 5, each with the rule by which it is judged.

use mackrl::tabular::{Learner, Run};
use mackrl_env::matrix_game::{CommonKnowledge, ObservationDistribution};

use super::findings::{EQUAL, ERRORS, Findings, NEAR, ROUNDING, mean, name, range};
use crate::reproduce::{Claim, ClaimSource, Verdict};

/// Runs of each learner at each point from which on claims about what is learnt are judged: with 30, two standard errors are the 95 %
/// interval.
const RUNS_LEAST: usize = 30;

/// Judges every claim; those about what is learnt, if there are runs enough.
pub(super) fn claims(findings: &Findings<'_>) -> Vec<Claim> {
    let runs = findings.sweep.runs(Learner::Mackrl, 0).len();
    let mut claims = about_learning(findings);
    if runs < RUNS_LEAST {
        for claim in &mut claims {
            claim.verdict = Verdict::NotTested;
            claim.evidence =
                format!("Needs {RUNS_LEAST} runs of each learner at each point; there are {runs}.");
        }
    }
    claims.push(optima_are_as_derived(findings));
    claims
}

fn about_learning(findings: &Findings<'_>) -> Vec<Claim> {
    vec![
        reproduces_independent_learning(findings),
        joint_learning_ignores_private_observations(findings),
        matches_joint_learning(findings),
        outperforms_both(findings),
        delegates_on_average(findings),
        delegates_in_every_run(findings),
        is_optimal(findings),
        published_points_are_met(findings),
    ]
}

fn reproduces_independent_learning(findings: &Findings<'_>) -> Claim {
    let (holds, difference) = findings.equal(Learner::Mackrl, Learner::Iac, 0);
    let best = findings.optima[0];
    let published = findings.published_pair(Learner::Mackrl, Learner::Iac, 0.0);
    let (delegating, joint): (Vec<&Run>, Vec<&Run>) = (findings.sweep.runs(Learner::Mackrl, 0))
        .iter()
        .partition(|run| run.delegation[CommonKnowledge::Nothing.index()] > 0.5);
    Claim {
        claim: "Without common knowledge (p = 0), MACKRL reproduces the performance of independent actors".into(),
        source: ClaimSource::Paper,
        verdict: Verdict::of(holds),
        evidence: format!(
            "MACKRL − IAC = {difference}; equal means within ±{EQUAL} of 0 with {ERRORS} standard errors added. {published} In {} of \
             {} runs the pair controller comes to prefer a joint action, which cannot earn more than {:.3}; the others \
             average {:.3}. The best policies of both classes earn the same ({:.3} and {:.3}), so the difference is one of \
             learning.",
            joint.len(),
            joint.len() + delegating.len(),
            best.jal,
            mean(&delegating, findings.quantity()),
            best.mackrl,
            best.decentralised
        ),
    }
}

fn joint_learning_ignores_private_observations(findings: &Findings<'_>) -> Claim {
    let jal = findings.curve(Learner::Jal);
    let shortfall = (findings.optima.iter().zip(&jal.mean))
        .map(|(best, mean)| best.jal - mean)
        .fold(0.0, f64::max);
    let (ahead, difference) = findings.greater(Learner::Iac, Learner::Jal, 0);
    let best = findings.optima[0];
    Claim {
        claim:
            "Without common knowledge, joint-action learning fails to use the private observations"
                .into(),
        source: ClaimSource::Paper,
        verdict: Verdict::of(ahead && shortfall < NEAR && best.jal < best.decentralised),
        evidence: format!(
            "At p = 0 JAL earns {:.3}, and no policy on common knowledge alone earns more than {:.3}; private observations \
             are worth up to {:.3}. IAC − JAL = {difference}. JAL learns what it can: it ends at most {shortfall:.3} below \
             its optimum at every p.",
            jal.mean[0], best.jal, best.decentralised
        ),
    }
}

fn matches_joint_learning(findings: &Findings<'_>) -> Claim {
    let last = findings.points.len() - 1;
    let (holds, difference) = findings.equal(Learner::Mackrl, Learner::Jal, last);
    let published = findings.published_pair(Learner::Mackrl, Learner::Jal, 1.0);
    Claim {
        claim: "With common knowledge always available (p = 1), MACKRL matches JAL".into(),
        source: ClaimSource::Paper,
        verdict: Verdict::of(holds),
        evidence: format!(
            "MACKRL − JAL = {difference}; equal means within ±{EQUAL} of 0 with {ERRORS} standard \
             errors added. {published}"
        ),
    }
}

fn outperforms_both(findings: &Findings<'_>) -> Claim {
    let between: Vec<usize> = (0..findings.points.len())
        .filter(|&point| findings.points[point] > 0.0 && findings.points[point] < 1.0)
        .collect();
    let margins = |rival| {
        let list: Vec<String> = (between.iter())
            .map(|&point| {
                let (ahead, difference) = findings.greater(Learner::Mackrl, rival, point);
                let mark = if ahead { "" } else { " (not ahead)" };
                format!("{:.1}: {difference}{mark}", findings.points[point])
            })
            .collect();
        list.join(", ")
    };
    let ahead = |rival, &point: &usize| findings.greater(Learner::Mackrl, rival, point).0;
    let rivals = [Learner::Iac, Learner::Jal];
    let wins = (between.iter())
        .filter(|point| rivals.iter().all(|&rival| ahead(rival, point)))
        .count();
    let published_exceptions: Vec<String> = (between.iter())
        .filter_map(|&point| {
            let p = findings.points[point];
            let [mackrl, iac, jal] = [Learner::Mackrl, Learner::Iac, Learner::Jal]
                .map(|learner| findings.published.at(learner, p));
            let (mackrl, best) = (mackrl?, iac?.max(jal?));
            (mackrl <= best).then(|| format!("p = {p:.1} ({mackrl:.3} against {best:.3})"))
        })
        .collect();
    let published = match published_exceptions.join(", ") {
        none if none.is_empty() => "The published figure has it ahead everywhere.".into(),
        exceptions => {
            format!("The published figure itself does not have it ahead at {exceptions}.")
        }
    };
    Claim {
        claim: "At intermediate probabilities (0 < p < 1), MACKRL outperforms both IAC and JAL"
            .into(),
        source: ClaimSource::Paper,
        verdict: Verdict::of(wins == between.len()),
        evidence: format!(
            "It is ahead of both by more than {ERRORS} standard errors at {wins} of {} points. MACKRL − IAC at {}. MACKRL − \
             JAL at {}. {published}",
            between.len(),
            margins(Learner::Iac),
            margins(Learner::Jal)
        ),
    }
}

fn delegates_on_average(findings: &Findings<'_>) -> Claim {
    let delegation = &findings.delegation;
    let off = range(delegation.nothing.mean.iter().flatten());
    let on = range(
        (delegation
            .matrix_a
            .mean
            .iter()
            .chain(&delegation.matrix_b.mean))
        .flatten(),
    );
    Claim {
        claim: "On average, MACKRL delegates when the common-knowledge bit is absent and acts jointly when it is present"
            .into(),
        source: ClaimSource::Paper,
        verdict: Verdict::of(off[0] > 0.5 && on[1] < 0.5),
        evidence: format!(
            "Mean probability of delegation where the state occurs, over all p: {:.3} to {:.3} with the bit off, {:.3} to \
             {:.3} with it on. The rule asks for more than half with the bit off and less than half with it on.",
            off[0], off[1], on[0], on[1]
        ),
    }
}

fn delegates_in_every_run(findings: &Findings<'_>) -> Claim {
    let [least, most] = range(&findings.delegation.runs_as_described);
    Claim {
        claim: "It does so whenever the bit is absent or present, in every run".into(),
        source: ClaimSource::Paper,
        verdict: Verdict::of(least == 1.0),
        evidence: format!(
            "In {:.0} % to {:.0} % of the runs, depending on p, the choice between delegation and joint action is the one \
             described in every state that occurs. Where the matrix is commonly known, delegating \
             to agents that play the best joint action themselves earns as much as playing it jointly.",
            100.0 * least,
            100.0 * most
        ),
    }
}

fn is_optimal(findings: &Findings<'_>) -> Claim {
    let curve = findings.curve(Learner::Mackrl);
    let gap = |point: usize| findings.optima[point].mackrl - curve.mean[point];
    let met: Vec<String> = (0..findings.points.len())
        .filter(|&point| gap(point) <= NEAR)
        .map(|point| format!("{:.1}", findings.points[point]))
        .collect();
    let widest = (0..findings.points.len())
        .max_by(|&left, &right| gap(left).total_cmp(&gap(right)))
        .unwrap_or(0);
    Claim {
        claim: "What MACKRL learns corresponds to the optimal policy".into(),
        source: ClaimSource::Paper,
        verdict: Verdict::of(met.len() == findings.points.len()),
        evidence: format!(
            "An optimal policy delegates when the bit is off and may act jointly when it is on: the pattern described is that \
             of an optimal policy, the actions behind it often are not. The mean return is within {NEAR} of the optimum at \
             {} of {} points ({}), and furthest from it at p = {:.1}: {:.3} of {:.3}.",
            met.len(),
            findings.points.len(),
            if met.is_empty() {
                "none".into()
            } else {
                format!("p = {}", met.join(", "))
            },
            findings.points[widest],
            curve.mean[widest],
            findings.optima[widest].mackrl
        ),
    }
}

fn published_points_are_met(findings: &Findings<'_>) -> Claim {
    let (mut compared, mut widest) = (0, 0.0_f64);
    let mut missed = Vec::new();
    let mut furthest = (0.0_f64, String::new());
    for learner in Learner::ALL {
        let ours = findings.curve(learner);
        for (point, &p) in findings.points.iter().enumerate() {
            let Some(published) = findings.published.at(learner, p) else {
                continue;
            };
            compared += 1;
            let (mean, sem) = (ours.mean[point], ours.sem[point]);
            widest = widest.max(sem);
            let distance = (mean - published).abs();
            let place = format!(
                "{} at p = {p:.1}: {mean:.3} ± {sem:.3}, published {published:.3}",
                name(learner)
            );
            if distance > NEAR {
                missed.push(place.clone());
            }
            if distance > furthest.0 {
                furthest = (distance, place);
            }
        }
    }
    let missed = match missed.len() {
        0 => String::new(),
        count => format!(
            " Further than that: {count} points ({}).",
            missed.join("; ")
        ),
    };
    Claim {
        claim: format!("Every published point lies within {NEAR} of ours"),
        source: ClaimSource::Reproduction,
        verdict: Verdict::of(missed.is_empty()),
        evidence: format!(
            "{compared} points of {}. Standard errors of ours reach {widest:.3}. The largest difference is {:.3}, {}.{missed}",
            findings.published.source, furthest.0, furthest.1
        ),
    }
}

fn optima_are_as_derived(findings: &Findings<'_>) -> Claim {
    // The MACKRL optimum of the NeurIPS game has no formula of one piece.
    let (formulae, jal_slope, mackrl) = match findings.distribution {
        ObservationDistribution::Y2018 => (
            "0.5 + 0.5p for JAL and 0.75 + 0.25p for IAC and MACKRL",
            0.5,
            Some([0.75, 0.25]),
        ),
        ObservationDistribution::NeurIps2019 => (
            "0.5 + 0.375p for JAL, and the same for IAC as for MACKRL",
            0.375,
            None,
        ),
    };
    let error = (findings.points.iter().zip(findings.optima))
        .map(|(&p, best)| {
            let of_jal = best.jal - (0.5 + jal_slope * p);
            let of_mackrl = mackrl.map_or(0.0, |[start, slope]| best.mackrl - (start + slope * p));
            let of_iac = best.mackrl - best.decentralised;
            of_jal.abs().max(of_mackrl.abs()).max(of_iac.abs())
        })
        .fold(0.0, f64::max);
    Claim {
        claim: format!("The best returns are exactly {formulae}"),
        source: ClaimSource::Reproduction,
        verdict: Verdict::of(error < ROUNDING),
        evidence: format!(
            "Enumeration of all deterministic policies at {} points; largest difference {error:.1e}. Whatever MACKRL gains \
             over IAC is gained in learning: it can express nothing better.",
            findings.points.len()
        ),
    }
}

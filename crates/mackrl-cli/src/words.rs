//! How well a team plays, in words.

use mackrl_run::training::Score;

/// What worlds of battles call their success.
const BATTLE_WON: &str = "battle_won";
/// What is measured where a world declares no success.
const RETURN: &str = "return";

/// "won 98.1 % ± 0.8 of 320 battles", or the mean of another measure with its standard error.
pub(crate) fn did(measure: &str, score: &Score) -> String {
    let Score {
        mean,
        standard_error,
        episodes,
        ..
    } = score;
    match measure {
        // Where all episodes end alike, there is no spread to estimate an error from.
        BATTLE_WON if *mean >= 1.0 => format!("won all of {episodes} battles"),
        BATTLE_WON if *mean <= 0.0 => format!("won none of {episodes} battles"),
        BATTLE_WON => format!(
            "won {:.1} % ± {:.1} of {episodes} battles",
            100.0 * mean,
            100.0 * standard_error
        ),
        RETURN => {
            format!("reached a return of {mean:.2} ± {standard_error:.2} in {episodes} episodes")
        }
        other => format!("reached {other} {mean:.3} ± {standard_error:.3} in {episodes} episodes"),
    }
}

/// "won 93.8 to 100.0 %", or the range of another measure.
pub(crate) fn between(measure: &str, least: f64, most: f64) -> String {
    match measure {
        BATTLE_WON => format!("won {:.1} to {:.1} %", 100.0 * least, 100.0 * most),
        RETURN => format!("reached returns of {least:.2} to {most:.2}"),
        other => format!("reached {other} {least:.3} to {most:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_score_is_told_as_people_tell_it() {
        let score = |mean| Score {
            steps_env: 7,
            mean,
            standard_error: 0.0078,
            episodes: 320,
        };
        assert_eq!(
            did("battle_won", &score(0.981)),
            "won 98.1 % ± 0.8 of 320 battles"
        );
        assert_eq!(did("battle_won", &score(1.0)), "won all of 320 battles");
        assert_eq!(did("battle_won", &score(0.0)), "won none of 320 battles");
        assert_eq!(
            did("return", &score(-3.0)),
            "reached a return of -3.00 ± 0.01 in 320 episodes"
        );
        assert_eq!(
            did("success", &score(0.25)),
            "reached success 0.250 ± 0.008 in 320 episodes"
        );
    }
}

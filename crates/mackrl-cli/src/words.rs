//! How well a team plays, in words.

use mackrl_run::training::Score;

/// What worlds of battles call their success.
pub(crate) const BATTLE_WON: &str = "battle_won";
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

/// "won 93.8 to 100.0 %", or the range of another measure; one number where both ends read the same.
pub(crate) fn between(measure: &str, least: f64, most: f64) -> String {
    let shares = [least, most].map(|share| format!("{:.1}", 100.0 * share));
    match measure {
        BATTLE_WON if least >= 1.0 => "won every battle".to_owned(),
        BATTLE_WON if most <= 0.0 => "won no battle".to_owned(),
        BATTLE_WON if shares[0] == shares[1] => format!("won {} % each", shares[0]),
        BATTLE_WON => format!("won {} to {} %", shares[0], shares[1]),
        RETURN if least == most => format!("reached a return of {least:.2} each"),
        RETURN => format!("reached returns of {least:.2} to {most:.2}"),
        other if least == most => format!("reached {other} {least:.3} each"),
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

    #[test]
    fn a_range_without_width_is_one_number() {
        let told = |measure, least, most| between(measure, least, most);
        assert_eq!(told("battle_won", 0.5, 1.0), "won 50.0 to 100.0 %");
        assert_eq!(told("battle_won", 1.0, 1.0), "won every battle");
        assert_eq!(told("battle_won", 0.0, 0.0), "won no battle");
        assert_eq!(told("battle_won", 0.96875, 0.96875), "won 96.9 % each");
        assert_eq!(told("return", 2.0, 3.5), "reached returns of 2.00 to 3.50");
        assert_eq!(told("return", 2.0, 2.0), "reached a return of 2.00 each");
        assert_eq!(told("success", 0.25, 0.5), "reached success 0.250 to 0.500");
    }
}

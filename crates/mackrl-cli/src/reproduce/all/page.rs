//! The report as one HTML page that needs no other file.

use super::Claim;
use crate::{
    output::escaped,
    reproduce::{ClaimSource, Verdict},
};
use mackrl_run::provenance::CODE;

const STYLE: &str = include_str!("page.css");

/// One part of the page.
pub(super) struct Section<'a> {
    pub(super) title: &'static str,
    /// SVG documents.
    pub(super) charts: Vec<String>,
    pub(super) claims: &'a [Claim],
    /// What the command prints: our numbers beside the published ones.
    pub(super) text: String,
    /// Where the numbers come from, as JSON.
    pub(super) provenance: String,
}

/// The whole page.
pub(super) fn html(command: &str, claims: &[(&str, &Claim)], sections: &[Section<'_>]) -> String {
    let count = |verdict| {
        let judged = claims.iter().filter(|(_, claim)| claim.verdict == verdict);
        judged.count()
    };
    let mut body = format!(
        "<h1>MACKRL, reproduced</h1>\n\
         <p>Multi-Agent Common Knowledge Reinforcement Learning (Foerster, Schroeder de Witt and others, 2018) in a simulation of \
         StarCraft micromanagement. Every number on this page comes from <code>{}</code>, version {}. Of {} claims, {} hold in \
         these runs, {} do not, and {} are not tested by them.</p>\n",
        escaped(command),
        escaped(CODE),
        claims.len(),
        count(Verdict::Holds),
        count(Verdict::DoesNotHold),
        count(Verdict::NotTested),
    );
    body +=
        "<table><thead><tr><th>figure</th><th>claim</th><th>verdict</th></tr></thead>\n<tbody>\n";
    for (figure, claim) in claims {
        body += &format!(
            "<tr><td>{figure}</td><td>{}</td><td>{}</td></tr>\n",
            escaped(&claim.claim),
            badge(claim)
        );
    }
    body += "</tbody></table>\n";
    for (number, section) in sections.iter().enumerate() {
        body += &section.html(number);
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>MACKRL, reproduced</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

impl Section<'_> {
    fn html(&self, number: usize) -> String {
        let mut html = format!(
            "<section>\n<h2>{}</h2>\n<div class=\"charts\">\n",
            self.title
        );
        for (place, chart) in self.charts.iter().enumerate() {
            // Names inside a drawing are names of the whole page.
            let prefix = format!("chart-{number}-{place}-panel-");
            html += &(chart.replace("id=\"panel-", &format!("id=\"{prefix}")))
                .replace("url(#panel-", &format!("url(#{prefix}"));
        }
        html += "</div>\n";
        for claim in self.claims {
            let source = match claim.source {
                ClaimSource::Paper => "the paper says",
                ClaimSource::Reproduction => "we say",
            };
            html += &format!(
                "<div class=\"claim\">{} <span class=\"source\">{source}</span> {}<p>{}</p></div>\n",
                badge(claim),
                escaped(&claim.claim),
                escaped(&claim.evidence)
            );
        }
        for (summary, text) in [
            ("Numbers, published ones beside ours", &self.text),
            ("Where they come from", &self.provenance),
        ] {
            html += &format!(
                "<details><summary>{summary}</summary><pre>{}</pre></details>\n",
                escaped(text)
            );
        }
        html + "</section>\n"
    }
}

fn badge(claim: &Claim) -> &'static str {
    match claim.verdict {
        Verdict::Holds => "<b class=\"holds\">holds</b>",
        Verdict::DoesNotHold => "<b class=\"fails\">does not hold</b>",
        Verdict::NotTested => "<b class=\"open\">not tested</b>",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, LineChart};

    fn chart() -> LineChart {
        let axis = || Axis {
            label: "x".into(),
            range: Some([0.0, 1.0]),
        };
        LineChart {
            title: "Chart".into(),
            subtitle: String::new(),
            x_axis: axis(),
            y_axis: axis(),
            series: Vec::new(),
        }
    }

    #[test]
    fn the_page_holds_everything_and_asks_for_nothing_else() {
        let claim = |verdict| Claim {
            claim: "a < b".into(),
            source: ClaimSource::Paper,
            verdict,
            evidence: "\"1\" & 2".into(),
        };
        let claims = [claim(Verdict::Holds), claim(Verdict::NotTested)];
        let section = Section {
            title: "Figure 0",
            charts: vec![chart().to_svg(), chart().to_svg()],
            claims: &claims,
            text: "numbers".into(),
            provenance: "{}".into(),
        };
        let listed = [("Figure 0", &claims[0]), ("Figure 0", &claims[1])];
        let html = html("mackrl reproduce all", &listed, &[section]);
        assert_eq!(html.matches("<svg ").count(), 2);
        for place in ["chart-0-0-panel-0", "chart-0-1-panel-0"] {
            assert_eq!(
                html.matches(&format!("id=\"{place}\"")).count(),
                1,
                "{place}"
            );
            assert!(html.contains(&format!("url(#{place})")), "{place}");
        }
        assert!(
            html.contains("a &lt; b") && html.contains("&quot;1&quot; &amp; 2"),
            "{html}"
        );
        assert!(
            html.contains("1 hold in") && html.contains("0 do not, and 1 are not tested"),
            "{html}"
        );
        for outside in ["src=", "href=", "@import", "<script"] {
            assert!(!html.contains(outside), "{outside}");
        }
    }
}

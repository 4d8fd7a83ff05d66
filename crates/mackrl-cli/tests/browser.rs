//! The page of a replay in a real browser: it is driven by events as a person causes them, and what it shows is compared with what
//! the library computes.
//!
//! `.ci/run browser` installs Chromium if it is missing and runs these tests; a plain `cargo test` leaves them out, visibly.
//! Set `CHROMIUM` to use another browser of its family.

use std::{
    collections::BTreeSet,
    env, fs,
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
};

use assert_cmd::cargo::cargo_bin;
use mackrl_env::{AgentId, EntityId};
use mackrl_run::replay::{GroupKnowledge, Playback, Replay};

/// Collects what goes wrong from the first line of the page on. A browser without a screen draws no frames, so they come by the
/// clock.
const WATCH: &str = r#"<script>
const problems = [];
requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);
addEventListener("error", (event) => problems.push("error: " + event.message));
addEventListener("securitypolicyviolation", (event) => problems.push("policy: " + event.violatedDirective));
for (const kind of ["error", "warn"]) console[kind] = (...words) => problems.push(kind + ": " + words.join(" "));
</script>"#;

/// Functions with which a script acts as a person does; `report` adds a line to what the test reads.
const HANDS: &str = r##"
const lines = [];
const report = (...words) => lines.push(words.join("|"));
const scrubTo = (step) => { const scrub = document.getElementById("scrub"); scrub.value = step; scrub.dispatchEvent(new Event("input", { bubbles: true })); };
const press = (key, shiftKey = false) => document.body.dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey, bubbles: true, cancelable: true }));
const click = (selector) => document.querySelector(selector).click();
const clock = () => document.getElementById("clock").textContent;
const living = () => [...document.querySelectorAll("#agents button:not(:disabled)")].map((button) => button.dataset.agent);
const chips = (id) => [...document.querySelectorAll(`#${id} button`)];
const shown = (id) => chips(id).map((chip) => chip.dataset.entity).join(" ");
const finish = () => {
  const result = document.createElement("pre");
  result.id = "result";
  result.textContent = ["begin", ...problems, ...lines, "end"].join("\n");
  document.body.append(result);
};
"##;

fn mackrl(folder: &Path, line: &str) {
    let output = Command::new(cargo_bin("mackrl"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program starts");
    let says = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "`{line}`: {says}");
}

/// What `script` reports when it runs in the page `html`, which has room of `width` pixels.
fn drive(folder: &Path, html: &str, script: &str, width: u32) -> Vec<String> {
    let page = fs::read_to_string(folder.join(html)).expect("the page was written");
    let page = page.replacen("<head>", &format!("<head>{WATCH}"), 1);
    let (page, end) = page.rsplit_once("</body>").expect("a page ends");
    let driven = folder.join("driven.html");
    let text = format!(
        "{page}<script>{HANDS}try {{ {script} }} catch (error) {{ problems.push(`error: ${{error.stack}}`); finish(); }}</script></body>{end}"
    );
    fs::write(&driven, text).expect("the folder can be written");
    let dom = browse(folder, &format!("file://{}", driven.display()), width);
    let result = dom.split_once("<pre id=\"result\">begin\n");
    let result = result.and_then(|(_, rest)| rest.split_once("\nend</pre>"));
    let (result, _) = result.unwrap_or_else(|| panic!("the page did not finish: {dom}"));
    result.lines().map(str::to_owned).collect()
}

/// The document at an address once its scripts have run for twenty seconds of the page's time.
fn browse(folder: &Path, address: &str, width: u32) -> String {
    let browser = env::var("CHROMIUM").unwrap_or_else(|_| "chromium".to_owned());
    let output = Command::new(&browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"])
        .args(["--virtual-time-budget=20000", "--timeout=120000"])
        .arg(format!("--window-size={width},900"))
        .arg(format!(
            "--user-data-dir={}",
            folder.join("browser").display()
        ))
        .arg(address)
        .output()
        .unwrap_or_else(|error| {
            panic!("cannot start {browser}: {error}; `.ci/run browser` installs it")
        });
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A folder with the page and the playback of an untrained team's battle, whose settings are options of `train`.
fn team(folder: &Path, settings: &str) -> Playback {
    mackrl(
        folder,
        &format!("train {settings} --steps 100 --out run --set test.episodes=1"),
    );
    mackrl(
        folder,
        "evaluate run --episodes 1 --save-replays 1 --seed 1",
    );
    let file = "run/replays/seed1-episode0.replay.gz";
    mackrl(folder, &format!("replay {file} --html page.html"));
    let bytes = fs::read(folder.join(file)).expect("the replay was written");
    let replay = Replay::from_bytes(&bytes).expect("a replay");
    replay.play().expect("it plays as recorded")
}

/// How the page and the library say the same: sets of entities, each with those who see it if not all do.
fn as_shown(knowledge: &GroupKnowledge) -> [String; 3] {
    let joined = |entities: Vec<String>| entities.join(" ");
    let all = |set: mackrl_env::EntitySet| {
        let indices = set.iter().map(EntityId::index);
        joined(indices.map(|index| index.to_string()).collect())
    };
    let private = knowledge
        .private
        .iter()
        .flat_map(|private| private.entities.iter());
    let private: BTreeSet<usize> = private.map(EntityId::index).collect();
    [
        all(knowledge.common),
        all(knowledge.mutual),
        joined(private.into_iter().map(|index| index.to_string()).collect()),
    ]
}

#[test]
#[ignore = "needs chromium; run by `.ci/run browser`"]
fn the_page_shows_the_sets_that_the_library_computes_at_every_step() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let playback = team(folder.path(), "--map 2s3z --preset paper");
    let script = r##"
      const choose = (group) => { press("Escape"); for (const agent of group) click(`#agents [data-agent="${agent}"]`); };
      for (let step = 0; step <= Number(document.getElementById("scrub").max); step++) {
        scrubTo(step); press("Escape");
        const agents = living();
        const groups = [agents, ...agents.map((agent) => [agent])];
        for (const a of agents) for (const b of agents) if (Number(a) < Number(b)) groups.push([a, b]);
        for (const group of groups) {
          choose(group);
          report(step, group.join(" "), shown("common"), shown("mutual"), shown("private"));
        }
      }
      finish();
    "##;
    let lines = drive(folder.path(), "page.html", script, 1280);
    let mut groups = 0;
    for line in &lines {
        let [step, group, common, mutual, private] = line.split('|').collect::<Vec<_>>()[..] else {
            panic!("the page complains: {line}");
        };
        let number = |word: &str| word.parse::<usize>().expect("a number");
        let group: Vec<AgentId> = (group.split_whitespace())
            .map(|word| AgentId::new(number(word)))
            .collect();
        let expected = as_shown(&playback.knowledge(number(step), &group));
        assert_eq!(
            [common, mutual, private],
            expected.each_ref().map(String::as_str),
            "{line}"
        );
        groups += 1;
    }
    assert!(
        groups > 16 * playback.steps() / 2,
        "{groups} groups in {} steps",
        playback.steps()
    );
}

#[test]
#[ignore = "needs chromium; run by `.ci/run browser`"]
fn a_person_can_play_scrub_choose_and_read_why() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let playback = team(folder.path(), "--map 3m --preset paper");
    let script = r##"
      report("start", clock());
      press("ArrowRight"); press("ArrowRight"); report("keys", clock());
      press("End"); report("end", clock()); press("Home");
      scrubTo(3); report("scrub", clock());
      click("#forth"); report("forth", clock());
      press("Escape"); press("a"); press("c");
      report("letters", [...document.querySelectorAll('#agents [aria-pressed="true"]')].map((b) => b.textContent).join(""));
      chips("common")[0].click();
      report("why", document.getElementById("why").textContent);
      const pair = document.querySelector("#decision .pair[data-pair]");
      pair.click();
      report("pair", pair.dataset.pair, [...document.querySelectorAll('#agents [aria-pressed="true"]')].map((b) => b.dataset.agent).join(","), /joint|delegated/.test(pair.textContent));
      press("Escape");
      const place = placeOf(1, current.step), frame = canvas.getBoundingClientRect();
      canvas.dispatchEvent(new MouseEvent("click", { clientX: frame.left + place[0], clientY: frame.top + place[1], bubbles: true }));
      report("click", [...document.querySelectorAll('#agents [aria-pressed="true"]')].length);
      report("names", [...document.querySelectorAll("button, select, input")].every((e) => e.textContent.trim() || e.getAttribute("aria-label")));
      report("wide", document.documentElement.scrollWidth <= innerWidth);
      report("plots", document.querySelectorAll(".plot").length);
      click("#theme"); click("#theme");
      scrubTo(0); press(" ");
            setTimeout(() => {
        press(" ");
        const paused = clock();
        report("played", paused);
        setTimeout(() => { report("paused", clock() === paused); finish(); }, 500);
      }, 1600);
    "##;
    for width in [1280, 390] {
        let lines = drive(folder.path(), "page.html", script, width);
        let last = playback.steps();
        let find = |name: &str| {
            let line = lines
                .iter()
                .find_map(|line| line.strip_prefix(&format!("{name}|")));
            line.unwrap_or_else(|| panic!("no {name} in {lines:#?}"))
                .to_owned()
        };
        assert_eq!(find("start"), format!("0 / {last}"));
        assert_eq!(find("keys"), format!("2 / {last}"));
        assert_eq!(find("end"), format!("{last} / {last}"));
        assert_eq!(find("scrub"), format!("3 / {last}"));
        assert_eq!(find("forth"), format!("4 / {last}"));
        assert_eq!(find("letters"), "AC");
        assert!(
            find("why").contains("A and C see each other"),
            "{}",
            find("why")
        );
        let pair = find("pair");
        let parts: Vec<&str> = pair.split('|').collect();
        assert_eq!((parts[0], parts[2]), (parts[1], "true"), "{pair}");
        assert!(["1", "2", "3"].contains(&&*find("click")), "{lines:#?}");
        assert_eq!(
            find("names"),
            "true",
            "everything that can be used has a name"
        );
        assert_eq!(
            find("wide"),
            "true",
            "the page is no wider than {width} pixels"
        );
        assert_eq!(find("plots"), "4");
        let played = find("played");
        let step = played.split(' ').next().map(str::parse::<usize>);
        let step = step.and_then(Result::ok).expect("a step");
        assert!(
            (5..=7).contains(&step),
            "1.6 s at 4 steps a second: {played}"
        );
        assert_eq!(find("paused"), "true");
        let complaints: Vec<_> = lines
            .iter()
            .filter(|line| line.contains(": ") && !line.contains('|'))
            .collect();
        assert!(complaints.is_empty(), "{complaints:#?}");
    }
}

#[test]
#[ignore = "needs chromium; run by `.ci/run browser`"]
fn larger_groups_than_pairs_are_shown_with_what_they_chose() {
    for (settings, caption, options) in [
        (
            "--map 3m --algorithm jal --set env.sight_range=64",
            "Team A, B and C",
            1..100,
        ),
        ("--map 2s3z --preset fours", "Group ", 3..4),
    ] {
        let folder = tempfile::tempdir().expect("a folder for the story");
        team(folder.path(), settings);
        let script = r##"
          scrubTo(0);
          for (const table of document.querySelectorAll("#decision table"))
            report(table.caption.textContent, table.rows.length, table.querySelectorAll("tr.taken").length);
          finish();
        "##;
        let lines = drive(folder.path(), "page.html", script, 1280);
        let own = lines.iter().find(|line| line.starts_with(caption));
        let own = own.unwrap_or_else(|| panic!("{settings}: {lines:?}"));
        let fields: Vec<&str> = own.split('|').collect();
        let rows: usize = fields[1].parse().expect("a number of rows");
        assert!(options.contains(&rows), "{own}");
        assert_eq!(fields[2], "1", "{own}");
    }
}

#[test]
#[ignore = "needs chromium; run by `.ci/run browser`"]
fn what_a_stranger_wrote_is_shown_and_not_run() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let folder = folder.path();
    let examples = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/scenarios/sniper-alley.toml"
    );
    let name = "<img src=x onerror=hacked=1><!--<script>.toml";
    fs::copy(examples, folder.join(name)).expect("the example is there");
    let output = Command::new(cargo_bin("mackrl"))
        .args(["play", "--save-replay", "x.gz", "--map", name])
        .current_dir(folder)
        .output()
        .expect("the program starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    mackrl(folder, "replay x.gz --html page.html");
    let script = r#"
      report("title", document.getElementById("title").textContent.length);
      report("images", document.images.length, typeof hacked);
      setTimeout(finish, 100);
    "#;
    let lines = drive(folder, "page.html", script, 1280);
    let title = format!("{} by focus-fire", name.trim_end_matches(".toml"));
    assert_eq!(
        lines,
        [
            format!("title|{}", title.len()),
            "images|0|undefined".to_owned()
        ]
    );
}

/// A server that ends with the test, however that ends.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill().and_then(|()| self.0.wait().map(drop));
    }
}

#[test]
#[ignore = "needs chromium; run by `.ci/run browser`"]
fn served_runs_are_drawn_with_their_replays() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    team(folder.path(), "--map 3m --preset paper");
    let server = Command::new(cargo_bin("mackrl"))
        .args(["serve", "run", "--port", "0"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut server = Server(server.expect("the program starts"));
    let mut address = String::new();
    let stdout = server.0.stdout.take().expect("stdout is read");
    BufReader::new(stdout)
        .read_line(&mut address)
        .expect("it says where it is");
    let address = address.trim();
    for width in [1280, 400] {
        let dom = browse(folder.path(), address, width);
        assert!(dom.contains("finished, "), "its status: {dom}");
        let plots = dom.matches("<section class=\"plot\">").count();
        let charts = dom.matches("class=\"uplot").count();
        assert!(
            plots >= 6 && charts == plots,
            "{plots} plots, {charts} charts"
        );
        for heading in ["Greedy tests", "Training", "Controllers"] {
            let title = format!("<h2>{heading}</h2>");
            assert!(dom.contains(&title), "the group {heading}: {dom}");
        }
        for controllers in ["pair_selector", "pair_controller", "agent_controller"] {
            let title = format!("<h3>mackrl/entropy_{controllers}</h3>");
            assert!(dom.contains(&title), "the entropy of {controllers}: {dom}");
        }
        assert!(!dom.contains("<li>"), "a problem: {dom}");
    }
    let dom = browse(folder.path(), address, 1280);
    let link = dom
        .split("href=\"")
        .filter_map(|rest| rest.split('"').next())
        .find(|link| link.ends_with("replays/seed1-episode0.replay.gz"));
    let replay = format!("{address}{}", link.expect("a link to its replay"));
    let page = browse(folder.path(), &replay, 1280);
    assert!(
        page.contains("<h1 id=\"title\">3m by mackrl, greedy</h1>"),
        "the replay's page"
    );
}

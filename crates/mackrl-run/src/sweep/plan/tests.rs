use super::*;

const PLAN: &str = r#"
out = "runs/here"
preset = "paper"
maps = ["3m", "2s3z"]
algorithms = ["mackrl", "central-v"]
seeds = 2

[settings]
run.steps_env = 1000
"test.episodes" = 7
"#;

fn parse(text: &str) -> Result<Plan> {
    Plan::parse("plan.toml", text, None, Path::new("runs/plan"))
}

fn names(text: &str) -> Vec<String> {
    let entries = parse(text).unwrap().entries.into_iter();
    entries.map(|entry| entry.name).collect()
}

fn refusal(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

#[test]
fn every_combination_of_map_algorithm_and_seed_is_a_run() {
    let plan = parse(PLAN).unwrap();
    assert_eq!(plan.out, Path::new("runs/here"));
    assert_eq!(plan.entries.len(), 8);
    let last = &plan.entries[7];
    assert_eq!(last.name, "2s3z-central-v-seed2");
    assert_eq!(last.folder, Path::new("runs/here/2s3z-central-v-seed2"));
    assert_eq!(
        (last.config.run.steps_env, last.config.test.episodes),
        (1000, 7)
    );
    assert_eq!((last.config.env.map(), last.config.run.seed), ("2s3z", 2));
}

#[test]
fn lists_multiply_and_variants_have_settings_of_their_own() {
    let text = "maps = [\"3m\"]\nseeds = [5]\n[vary]\nalgorithm.gamma = [0.5, 1.0]\n\
                [variants.full]\n[variants.alone]\nalgorithm.name = \"central-v\"\n";
    let expected = [
        "3m-central-v-alone-gamma-0.5-seed5",
        "3m-central-v-alone-gamma-1.0-seed5",
        "3m-mackrl-ppo-full-gamma-0.5-seed5",
        "3m-mackrl-ppo-full-gamma-1.0-seed5",
    ];
    assert_eq!(names(text), expected);
    assert_eq!(
        parse(text).unwrap().entries[0]
            .config
            .get("algorithm.gamma"),
        Some(0.5.into())
    );
}

#[test]
fn without_a_list_the_preset_names_the_algorithm() {
    for (preset, algorithm) in [("default", "mackrl-ppo"), ("paper", "mackrl")] {
        let text = format!("preset = \"{preset}\"\nmaps = [\"3m\"]\nseeds = 1\n");
        assert_eq!(names(&text), [format!("3m-{algorithm}-seed1")]);
    }
}

#[test]
fn a_map_has_settings_and_seeds_of_its_own() {
    let text = "maps = [\"3m\", \"2s3z\", \"8m\"]\nalgorithms = [\"mappo\", \"ippo\"]\nseeds = 3\n\
                order = \"by-seed\"\n[settings]\nrun.steps_env = 10\n\
                [on.2s3z]\nseeds = [7]\nrun.steps_env = 20\n[on.8m]\nseeds = 2\n";
    let expected = [
        "3m-mappo-seed1",
        "3m-ippo-seed1",
        "2s3z-mappo-seed7",
        "2s3z-ippo-seed7",
        "8m-mappo-seed1",
        "8m-ippo-seed1",
        "3m-mappo-seed2",
        "3m-ippo-seed2",
        "8m-mappo-seed2",
        "8m-ippo-seed2",
        "3m-mappo-seed3",
        "3m-ippo-seed3",
    ];
    assert_eq!(names(text), expected);
    let steps = |entry: usize| parse(text).unwrap().entries[entry].config.run.steps_env;
    assert_eq!([steps(0), steps(2), steps(4)], [10, 20, 10]);
    let by_map = names(&text.replace("by-seed", "by-map"));
    assert_eq!(
        by_map[..3],
        ["3m-mappo-seed1", "3m-mappo-seed2", "3m-mappo-seed3"]
    );
}

#[test]
fn errors_name_line_and_column() {
    for (change, expected) in [
        (
            "maps = [\"3m\"]\nseed = 2\n",
            "plan.toml:2:1: `seed` is not a word of plans; write `seeds`",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\nsteps = 60000\n",
            "plan.toml:3:1: `steps` is not a word of plans; write `run.steps_env = 60000` below [settings]",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[run]\nsteps_env = 60000\n",
            "plan.toml:4:1: `run.steps_env` is not a word of plans; write `run.steps_env = 60000` below [settings]",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\ngamma = 0.9\n",
            "plan.toml:3:1: `gamma` is not a word of plans; write `algorithm.gamma = 0.9` below [settings]",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\ncolour = 1\n",
            "plan.toml:3:1: `colour` is not a word of plans, expected out, preset, maps",
        ),
        (
            "maps = [\"3m\"]\nseeds = 0\n",
            "plan.toml:2:9: `seeds` is not a number",
        ),
        (
            "maps = [\"3m\"]\nseeds = \"x\"\n",
            "plan.toml:2:9: expected a number of seeds",
        ),
        (
            "maps = []\nseeds = 1\n",
            "plan.toml:1:8: the plan has 0 runs",
        ),
        (
            "maps = [\"3n\"]\nseeds = 1\n",
            "plan.toml:1:8: unknown map `3n`, did you mean `3m`?",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\npreset = \"papr\"\n",
            "plan.toml:3:10: unknown preset",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[settings]\nalgorithm.gama = 1\n",
            "plan.toml:4:18: unknown key `algorithm.gama`, did you mean `algorithm.gamma`?",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[settings]\nalgorithm.gamma = 7.0\n",
            "plan.toml:4:19: `algorithm.gamma` is 7.0",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[settings]\nrun.seed = 7\n",
            "plan.toml:4:12: `run.seed` is given by `seeds`",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[vary]\nalgorithm.gamma = 0.5\n",
            "plan.toml:4:19: `algorithm.gamma` is 0.5, expected a list",
        ),
        (
            "maps = [\"3m\"]\nseeds = [1, 1]\n",
            "plan.toml:1:8: two runs would be called 3m-mackrl-ppo-seed1",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[on.8m]\nrun.steps_env = 7\n",
            "plan.toml:4:17: `on.8m` is about a map that `maps` does not list",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[on.3m]\nseeds = 0\n",
            "plan.toml:4:9: `seeds` is not a number",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[on.3m]\nrun.stesp_env = 7\n",
            "plan.toml:4:17: unknown key `run.stesp_env`",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[on.3m]\nrun.seed = 7\n",
            "plan.toml:4:12: `run.seed` is given by `seeds`",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\norder = \"by-chance\"\n",
            "plan.toml:3:9: unknown variant `by-chance`",
        ),
        (
            "maps = [\"3m\"]\nseeds = 1\n[variants.\"../x\"]\nalgorithm.gamma = 0.5\n",
            "plan.toml:4:19: `../x` is not a name",
        ),
        ("maps = [\"3m\"\n", "plan.toml:"),
    ] {
        let found = refusal(change);
        assert!(found.starts_with(expected), "{change}: {found}");
    }
}

#[test]
fn a_plan_cannot_ask_for_more_runs_than_anybody_wants() {
    assert!(refusal("maps = [\"3m\"]\nseeds = 10001\n").contains("1 to 10000"));
    let seeds: Vec<String> = (0..200).map(|seed| seed.to_string()).collect();
    let gammas: Vec<String> = (0..100)
        .map(|n| format!("{:.3}", f64::from(n) / 100.0))
        .collect();
    let text = format!(
        "maps = [\"3m\"]\nseeds = [{}]\n[vary]\nalgorithm.gamma = [{}]\n",
        seeds.join(", "),
        gammas.join(", ")
    );
    assert!(refusal(&text).contains("the plan has 20000 runs"));
}

#[test]
fn values_that_folders_cannot_be_called_after_are_made_plain() {
    assert_eq!(plain("../a b/ü"), "-a-b--");
    assert_eq!(plain("sampled:5"), "sampled-5");
}

#[test]
fn the_shipped_plans_are_plans() {
    let shipped = |file: &str| {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        parse(&std::fs::read_to_string(root.join(file)).unwrap()).unwrap()
    };
    let figure6 = shipped("examples/sweeps/figure6.toml");
    assert_eq!(figure6.entries.len(), 40);
    let comparison = shipped("results/ppo/plan.toml").entries;
    // Five seeds on five maps, three on three, of three learners; and the first of everything first.
    assert_eq!(comparison.len(), 3 * (5 * 5 + 3 * 3));
    let first = &comparison[..24];
    for Entry { name, config, .. } in first {
        let seed = match config.env.map() {
            "5m_vs_6m" | "MMM2" => 302,
            _ => 301,
        };
        assert_eq!(config.run.seed, seed, "{name}");
    }
    let last = &comparison[101];
    assert_eq!(last.name, "5m_vs_6m-ippo-seed306");
    assert_eq!(last.config.run.steps_env, 2_000_000);
}

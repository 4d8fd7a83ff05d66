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
        "3m-mackrl-full-gamma-0.5-seed5",
        "3m-mackrl-full-gamma-1.0-seed5",
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
fn errors_name_line_and_column() {
    for (change, expected) in [
        (
            "maps = [\"3m\"]\nseed = 2\n",
            "plan.toml:2:1: unknown field `seed`",
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
            "plan.toml:1:8: two runs would be called 3m-mackrl-seed1",
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
fn the_shipped_plan_is_a_plan() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/sweeps/figure6.toml"
    );
    let plan = parse(&std::fs::read_to_string(file).unwrap()).unwrap();
    assert_eq!(plan.entries.len(), 40);
}

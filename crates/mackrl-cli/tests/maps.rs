//! `mackrl maps --json` is the table of the SMAC client, column by column.

use std::process::Command;

use serde_json::{Value, json};

/// Columns of the table, in their order.
const COLUMNS: [&str; 14] = [
    "map",
    "agents",
    "enemies",
    "race a/b",
    "limit",
    "shield a/e",
    "type bits",
    "map_type",
    "n_actions",
    "obs size (move+enemies+allies+own)",
    "state size (allies+enemies+last actions)",
    "sumHP",
    "max_reward",
    "scale",
];

/// A file of the crate of the simulator.
fn simulator_file(name: &str) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../mackrl-skirmish");
    std::fs::read_to_string(format!("{folder}/{name}")).expect("the file is in the repository")
}

fn mackrl(words: &[&str]) -> Value {
    let output = Command::new(assert_cmd::cargo::cargo_bin("mackrl"))
        .args(words)
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{words:?}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Cells of a line of the table, without the empty ones before and after.
fn cells(line: &str) -> Vec<String> {
    let inner = line.trim_matches('|').split('|');
    inner.map(|cell| cell.trim().to_owned()).collect()
}

/// A map of the program as a line of the table.
fn line_of(map: &Value) -> Vec<String> {
    let text = |key: &str| map[key].as_str().expect(key).to_owned();
    let number = |key: &str| map[key].as_f64().expect(key);
    let product = |key: &str| format!("{}x{}", map[key][0], map[key][1]);
    vec![
        text("name"),
        map["n_agents"].to_string(),
        map["n_enemies"].to_string(),
        format!("{}/{}", text("a_race"), text("b_race")),
        map["episode_limit"].to_string(),
        format!("{}/{}", map["shield_bits_ally"], map["shield_bits_enemy"]),
        map["unit_type_bits"].to_string(),
        text("map_type"),
        map["n_actions"].to_string(),
        format!(
            "{}+{}+{}+{} = **{}**",
            map["obs_move_feats"],
            product("obs_enemy_feats"),
            product("obs_ally_feats"),
            map["obs_own_feats"],
            map["obs_size"]
        ),
        format!(
            "{}+{}+{} = **{}**",
            product("state_ally_feats"),
            product("state_enemy_feats"),
            product("state_last_actions"),
            map["state_size"]
        ),
        number("enemy_health").to_string(),
        number("max_reward").to_string(),
        format!("{:.5}", number("reward_scale")),
    ]
}

#[test]
fn the_list_is_the_table_of_smac_in_every_column() {
    let table = simulator_file("tests/golden/smac_maps.md");
    let mut lines = table.lines().filter(|line| line.starts_with("| "));
    assert_eq!(cells(lines.next().expect("a heading")), COLUMNS);
    let expected: Vec<Vec<String>> = lines.map(cells).collect();
    let listed = mackrl(&["maps", "--json"]);
    let listed = listed.as_array().expect("an array");
    assert_eq!((listed.len(), expected.len()), (23, 23));
    for (map, expected) in listed.iter().zip(expected) {
        for ((column, found), expected) in COLUMNS.iter().zip(line_of(map)).zip(expected) {
            assert_eq!(found, expected, "{column} of {}", map["name"]);
        }
    }
}

#[test]
fn a_map_is_shown_with_its_armies_its_order_and_its_terrain() {
    let map = mackrl(&["maps", "2c_vs_64zg", "--json"]);
    let listed = mackrl(&["maps", "--json"]);
    for (key, value) in listed[22].as_object().expect("an object") {
        assert_eq!(&map[key], value, "{key} in the list and in the map");
    }
    assert_eq!(
        map["allies"],
        json!([{"unit": "colossus", "count": 2, "at": [16.0, 16.0]}])
    );
    assert_eq!(
        map["enemies"],
        json!([{"unit": "zergling", "count": 64, "at": [16.0, 9.0]}])
    );
    assert_eq!(map["enemy_order"], "hunt");
    let terrain = map["terrain"].as_array().expect("lines");
    assert_eq!(terrain.len(), 32);
    // y = 12, the 20th line from above: ramps at either side of the cliff.
    assert_eq!(terrain[19], format!("....{}....", "#".repeat(24)));
    assert_eq!(map["starts"].as_array().map(Vec::len), Some(66));
    assert_eq!(map["starts"][0]["team"], "ally");
}

#[test]
fn a_terrain_that_is_shown_can_be_put_into_a_scenario() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("copy.toml");
    let map = mackrl(&["maps", "6h_vs_8z", "--json"]);
    let lines = map["terrain"].as_array().expect("lines").iter();
    let drawing: Vec<&str> = lines.map(|line| line.as_str().expect("a line")).collect();
    let shipped = simulator_file("maps/6h_vs_8z.toml");
    let own = format!("terrain = \"\"\"\n{}\n\"\"\"", drawing.join("\n"));
    let text = shipped.replace("terrain = \"arena-6h\"", &own);
    assert_ne!(text, shipped);
    std::fs::write(&file, text).expect("the folder can be written");
    let mut copy = mackrl(&["maps", file.to_str().expect("a UTF-8 path"), "--json"]);
    copy["name"] = map["name"].clone();
    assert!(copy["known"].is_null(), "a scenario is not SMAC's map");
    copy["known"] = map["known"].clone();
    assert_eq!(copy, map);
}

/// A file of the repository.
fn committed(name: &str) -> Option<Value> {
    let text = std::fs::read_to_string(format!("{}/../../{name}", env!("CARGO_MANIFEST_DIR")));
    text.ok()
        .map(|text| serde_json::from_str(&text).expect("JSON"))
}

/// The best results on a map that are committed.
fn best_results(map: &str) -> Value {
    let scripted = committed("results/scripted/scripted.json").expect("results of scripts");
    let won = |row: &Value| row["battle_won_mean"].as_f64().expect("a share");
    let mut script: Option<&Value> = None;
    for row in scripted["rows"].as_array().expect("rows") {
        if row["map"] == map && script.is_none_or(|best| won(row) > won(best)) {
            script = Some(row);
        }
    }
    let script = script.expect("every map was played by scripts");
    let source = format!("zoo/{map}");
    let team = committed(&format!("{source}/run.json")).map(|run| run["teams"].clone());
    let score = |which: &str| team.as_ref().map(|teams| teams[which].clone());
    let mean = |score: &Value| score["mean"].as_f64();
    let best = [score("best"), score("last")].into_iter().flatten();
    let best = best.reduce(|one, other| {
        if mean(&other) > mean(&one) {
            other
        } else {
            one
        }
    });
    let trained = best
        .map(|best| json!({ "won": best["mean"], "episodes": best["episodes"], "source": source }));
    json!({
        "map": map,
        "scripted": {
            "policy": script["policy"],
            "won": script["battle_won_mean"],
            "episodes": script["episodes"],
            "source": "results/scripted",
        },
        "trained": trained,
    })
}

/// `UPDATE_KNOWN=1` writes the file anew.
#[test]
fn known_results_are_those_that_are_committed() {
    let file = format!(
        "{}/src/commands/maps/known.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let names = mackrl_skirmish::map_names();
    let expected = Value::Array(names.iter().map(|map| best_results(map)).collect());
    if std::env::var_os("UPDATE_KNOWN").is_some() {
        let text = serde_json::to_string_pretty(&expected).expect("JSON") + "\n";
        std::fs::write(&file, text).expect("the file can be written");
    }
    let known = std::fs::read_to_string(&file).expect("the file is in the repository");
    let known: Value = serde_json::from_str(&known).expect("JSON");
    assert_eq!(
        known, expected,
        "UPDATE_KNOWN=1 cargo test -p mackrl --test maps"
    );
}

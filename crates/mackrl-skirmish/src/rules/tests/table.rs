//! Every row of the unit table, measured on the field: what units are made of, how fast they go, how far and how often they
//! strike, and what a strike does. Single rules have their own tests; here no type is left out.

use super::*;

/// A row: base Liberty, in seconds and map units.
struct Row {
    name: &'static str,
    /// Life and shield.
    body: [f32; 2],
    armour: f32,
    speed: f32,
    radius: f32,
    weapon: Option<Weapon>,
}

/// A weapon of the table.
#[derive(Clone, Copy)]
struct Weapon {
    range: f32,
    period_s: f32,
    damage_point_s: f32,
    /// What an attack takes from a unit without armour that is neither light nor armoured.
    damage: f32,
    /// More of it for the light and for the armoured.
    bonus: [f32; 2],
    /// Hits of an attack, each of which meets the armour.
    hits: f32,
    /// Whether it reaches flyers.
    hits_air: bool,
}

const fn row(name: &'static str, body: [f32; 2], armour: f32, speed: f32, radius: f32) -> Row {
    Row {
        name,
        body,
        armour,
        speed,
        radius,
        weapon: None,
    }
}

impl Row {
    const fn armed(self, range: f32, period_s: f32, damage_point_s: f32, damage: f32) -> Self {
        Self {
            weapon: Some(Weapon {
                range,
                period_s,
                damage_point_s,
                damage,
                bonus: [0.0; 2],
                hits: 1.0,
                hits_air: false,
            }),
            ..self
        }
    }

    const fn with(self, change: Weapon) -> Self {
        Self {
            weapon: Some(change),
            ..self
        }
    }

    const fn and_air(self) -> Self {
        let weapon = Weapon {
            hits_air: true,
            ..self.armament()
        };
        self.with(weapon)
    }

    const fn times(self, hits: f32) -> Self {
        let weapon = Weapon {
            hits,
            ..self.armament()
        };
        self.with(weapon)
    }

    const fn bonus(self, light: f32, armoured: f32) -> Self {
        let weapon = Weapon {
            bonus: [light, armoured],
            ..self.armament()
        };
        self.with(weapon)
    }

    const fn armament(&self) -> Weapon {
        self.weapon.expect("an armed row")
    }
}

const TABLE: [Row; 10] = [
    row("marine", [45.0, 0.0], 0.0, 2.25, 0.375)
        .armed(5.0, 0.8608, 0.05, 6.0)
        .and_air(),
    row("marauder", [125.0, 0.0], 1.0, 2.25, 0.5625)
        .armed(6.0, 1.5, 0.0, 10.0)
        .bonus(0.0, 10.0),
    row("medivac", [150.0, 0.0], 1.0, 2.75, 0.75),
    row("stalker", [80.0, 80.0], 1.0, 2.9531, 0.625)
        .armed(6.0, 1.44, 0.167, 10.0)
        .bonus(0.0, 4.0)
        .and_air(),
    row("zealot", [100.0, 50.0], 1.0, 2.25, 0.5)
        .armed(0.1, 1.2, 0.0, 8.0)
        .times(2.0),
    row("colossus", [200.0, 150.0], 1.0, 2.25, 1.0)
        .armed(6.0, 2.2, 0.0832, 20.0)
        .times(2.0),
    row("hydralisk", [80.0, 0.0], 0.0, 2.25, 0.625)
        .armed(5.0, 0.83, 0.208, 12.0)
        .and_air(),
    row("zergling", [35.0, 0.0], 0.0, 2.9531, 0.375).armed(0.1, 0.696, 0.167, 5.0),
    row("baneling", [30.0, 0.0], 0.0, 2.5, 0.375)
        .armed(0.25, 1.0, 0.0, 20.0)
        .bonus(15.0, 0.0),
    row("spine-crawler", [300.0, 0.0], 2.0, 0.0, 0.875)
        .armed(7.0, 1.6, 0.3332, 25.0)
        .bonus(0.0, 5.0),
];

/// The rows with weapons.
fn armed() -> impl Iterator<Item = (&'static Row, Weapon)> {
    TABLE
        .iter()
        .filter_map(|row| row.weapon.map(|weapon| (row, weapon)))
}

/// A marine or marauder of 10 000 life, so that nothing kills it.
fn target(arena: &mut Arena, name: &str, at: [f32; 2]) -> UnitIndex {
    let unit = arena.add(name, Enemy, Passive, at);
    arena.unit(unit).life = 10_000.0;
    unit
}

#[test]
fn the_table_has_every_type() {
    let types = &UnitTypes::load(UnitData::Liberty).unwrap().types;
    assert_eq!(types.len(), TABLE.len());
    for unit in types {
        assert!(
            TABLE.iter().any(|row| row.name == unit.name),
            "{}",
            unit.name
        );
    }
}

#[test]
fn fresh_units_have_the_life_and_the_shields_of_the_table() {
    for row in &TABLE {
        let mut arena = Arena::new();
        let unit = arena.add(row.name, Ally, Passive, [10.0, 16.0]);
        let unit = arena.unit(unit);
        assert_eq!([unit.life, unit.shield], row.body, "{}", row.name);
    }
}

#[test]
fn units_go_as_far_in_a_second_as_the_table_says() {
    for row in &TABLE {
        let mut arena = Arena::new();
        let unit = arena.add(row.name, Ally, Passive, [4.0, 16.0]);
        arena.battle.order(unit, Order::Move { to: [30.0, 16.0] });
        // Medivacs take 1.2 s to their full speed.
        arena.loops(32);
        let [before, _] = arena.at(unit);
        arena.loops(16);
        let [after, _] = arena.at(unit);
        let speed = after - before;
        assert!((speed - row.speed).abs() < 1e-4, "{}: {speed}", row.name);
    }
}

#[test]
fn armour_takes_its_part_of_every_hit_on_life_and_none_of_hits_on_shields() {
    for row in &TABLE {
        let (mut arena, _, other) = duel("marine", row.name, 3.0);
        (arena.unit(other).shield, arena.unit(other).unharmed) = (0.0, 0.0);
        // A shot lands in the second loop; zerg life has grown back a little since.
        arena.loops(2);
        let taken = row.body[0] - arena.unit(other).life;
        assert!(
            (taken - (6.0 - row.armour)).abs() < 0.04,
            "{}: {taken}",
            row.name
        );
        if row.body[1] > 0.0 {
            let (mut arena, _, other) = duel("marine", row.name, 3.0);
            arena.loops(2);
            let unit = arena.unit(other);
            assert_eq!([unit.life, unit.shield], [row.body[0], row.body[1] - 6.0]);
        }
    }
}

#[test]
fn attacks_begin_at_the_range_of_the_table_from_edge_to_edge() {
    for (row, weapon) in armed() {
        let reach = weapon.range + row.radius + 0.375;
        for (distance, begins) in [(reach - 0.005, true), (reach + 0.005, false)] {
            let (mut arena, one, _) = duel(row.name, "marine", distance);
            arena.loops(1);
            let unit = arena.unit(one);
            let has_begun = unit.swing.is_some() || unit.cooldown > 0.0 || !unit.is_alive();
            assert_eq!(has_begun, begins, "{} at {distance}", row.name);
        }
    }
}

#[test]
fn attacks_take_effect_at_the_damage_point_and_follow_each_other_by_the_period() {
    for (row, weapon) in armed().filter(|(row, _)| row.name != "baneling") {
        let mut arena = Arena::new();
        let one = arena.add(row.name, Ally, Passive, [10.0, 16.0]);
        let other = target(&mut arena, "marine", [10.0 + row.radius + 0.4, 16.0]);
        arena.attack(one, other);
        let mut effects = Vec::new();
        for number in 0..400_u16 {
            let before = arena.unit(one).cooldown;
            arena.loops(1);
            if arena.unit(one).cooldown > before + 1.0 {
                effects.push(f32::from(number));
            }
        }
        let first = (weapon.damage_point_s * 16.0).ceil();
        assert_eq!(effects[0], first, "{}: loops to the first effect", row.name);
        for (index, effect) in effects.iter().enumerate() {
            let due = (weapon.damage_point_s + index as f32 * weapon.period_s) * 16.0;
            let late = effect - due;
            assert!(
                (-0.01..1.01).contains(&late),
                "{}: attack {index} took effect {late} loops late",
                row.name
            );
        }
        assert!(
            effects.len() > 10,
            "{}: {} attacks",
            row.name,
            effects.len()
        );
    }
}

#[test]
fn an_attack_does_the_damage_of_the_table_to_the_light_and_to_the_armoured() {
    for (row, weapon) in armed() {
        for (name, armour, bonus) in [
            ("marine", 0.0, weapon.bonus[0]),
            ("marauder", 1.0, weapon.bonus[1]),
        ] {
            let mut arena = Arena::new();
            let one = arena.add(row.name, Ally, Passive, [10.0, 16.0]);
            let other = target(&mut arena, name, [11.0 + row.radius, 16.0]);
            arena.attack(one, other);
            arena.loops_until(|state| state.units[0].cooldown > 0.0 || !state.units[0].is_alive());
            // Missiles arrive, second blades and beams fall; the next attack is farther away than that.
            arena.battle.order(one, Order::Stop);
            arena.loops(10);
            let taken = 10_000.0 - arena.unit(other).life;
            let due = weapon.hits * (weapon.damage + bonus - armour);
            assert!(
                (taken - due).abs() < 0.01,
                "{} on a {name}: {taken}, not {due}",
                row.name
            );
        }
    }
}

#[test]
fn weapons_reach_flyers_only_if_the_table_says_so() {
    for row in &TABLE {
        let (mut arena, one, medivac) = duel(row.name, "medivac", 1.0);
        let obeys = arena.unit(one).order == (Order::Attack { target: medivac });
        let reaches = row.weapon.is_some_and(|weapon| weapon.hits_air);
        assert_eq!(
            obeys, reaches,
            "{} is ordered to attack a medivac",
            row.name
        );
        arena.loops(60);
        assert_eq!(arena.unit(medivac).life < 150.0, reaches, "{}", row.name);
    }
}

#[test]
fn what_legacy_of_the_void_changes_is_what_the_table_says() {
    let data = UnitTypes::load(UnitData::Lotv).unwrap();
    let weapon = |name: &str| data.find(name).unwrap().weapon.clone().unwrap();
    let medivac = data.find("medivac").unwrap();
    assert_eq!((medivac.speed, medivac.acceleration), (2.5, Some(2.25)));
    let stalker = weapon("stalker");
    assert_eq!((stalker.damage, stalker.period_s), (13.0, 1.87));
    assert_eq!(stalker.bonus.map(|bonus| bonus.damage), Some(5.0));
    let colossus = weapon("colossus");
    assert_eq!(
        (colossus.range, colossus.period_s, colossus.damage),
        (7.0, 1.5, 10.0)
    );
    assert_eq!(colossus.bonus.map(|bonus| bonus.damage), Some(5.0));
    assert_eq!(data.find("hydralisk").unwrap().life, 90.0);
    assert_eq!(weapon("hydralisk").period_s, 0.825);
    assert_eq!(weapon("spine-crawler").period_s, 1.85);
    let liberty = UnitTypes::load(UnitData::Liberty).unwrap();
    for same in ["marine", "marauder", "zealot", "zergling", "baneling"] {
        assert_eq!(data.find(same), liberty.find(same), "{same}");
    }
}

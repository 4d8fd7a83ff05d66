//! Unit types of a scenario: new ones, or shipped ones with some numbers changed.

use toml::{Table, Value};

use super::{
    Broken, in_question,
    places::Path,
    shortened,
    words::{nearest, plain},
};
use crate::unit_types::{UnitType, UnitTypes};

/// Most types that a scenario may define.
const TYPES_MAX: usize = 32;
/// Longest name of a type in characters.
const NAME_MAX: usize = 40;
/// Longest array within a type.
const ARRAY_MAX: usize = 8;
/// The table of a unit type, which has no name of its own.
const UNIT: &str = "unit";
/// Ranges of numbers that have a tighter one than [`ANY_NUMBER`]: the table, the field, the least and the greatest value.
const RANGES: [(&str, &str, f64, f64); 15] = [
    (UNIT, "life", 1.0, 1e5),
    (UNIT, "speed", 0.0, 4.0),
    (UNIT, "radius", 0.0, 2.0),
    (UNIT, "separation_radius", 0.0625, 2.0),
    (UNIT, "inner_radius", 0.0, 1.0),
    (UNIT, "type_id", 0.0, 1e6),
    ("weapon", "range", 0.0, 32.0),
    ("weapon", "range_slop", 0.0, 32.0),
    ("weapon", "period_s", 0.125, 120.0),
    ("weapon", "hits", 1.0, 8.0),
    ("heal", "range", 0.0, 32.0),
    ("missile", "speed", 1.0, 1000.0),
    ("burst", "radius", 0.0, 16.0),
    ("sweep", "spacing", 0.05, 16.0),
    ("sweep", "half_width", 0.0, 16.0),
];
/// Range of all other numbers.
const ANY_NUMBER: (f64, f64) = (0.0, 1e5);

/// The types of `units` and those that `tables` define; a table with `like = "marine"` states only what differs from a marine.
pub(super) fn extended(units: &UnitTypes, tables: &[Table]) -> Result<UnitTypes, Broken> {
    let mut units = units.clone();
    if tables.len() > TYPES_MAX {
        let message = format!(
            "the scenario defines {} unit types, expected at most {TYPES_MAX}",
            tables.len()
        );
        return Err((Path::new("unit"), message));
    }
    for (index, table) in tables.iter().enumerate() {
        let path = Path::new("unit").item(index);
        let unit = unit_type(&units, table, &path)?;
        units.types.retain(|other| other.name != unit.name);
        units.types.push(unit);
    }
    Ok(units)
}

/// In which words a type is refused that nobody defined.
pub(super) fn unknown(name: &str, units: &UnitTypes) -> String {
    let names: Vec<&str> = units.types.iter().map(|unit| unit.name.as_str()).collect();
    format!(
        "unit `{}` is unknown, expected one of {}{}",
        shortened(name),
        names.join(", "),
        in_question(nearest(name, names.iter().copied()))
    )
}

fn unit_type(units: &UnitTypes, table: &Table, path: &Path) -> Result<UnitType, Broken> {
    let broken = |message: String| (path.clone(), message);
    let mut merged = Table::new();
    let mut own = table.clone();
    if let Some(like) = own.remove("like") {
        let path = path.clone().field("like");
        let Some(name) = like.as_str() else {
            let message = format!("like is a {}, expected the name of a unit", like.type_str());
            return Err((path, message));
        };
        let model = units
            .find(name)
            .ok_or_else(|| (path, unknown(name, units)))?;
        merged = Table::try_from(model).map_err(|error| broken(error.to_string()))?;
    }
    check_numbers(UNIT, &own, path)?;
    lay(&mut merged, own);
    let unit: UnitType = serde_path_to_error::deserialize(merged).map_err(|error| {
        let message = plain(error.inner().message());
        let advice = if message.starts_with("missing field") {
            "; a unit states every statistic, or `like = \"marine\"` and what differs"
        } else {
            ""
        };
        (path.clone().down_to(error.path()), message + advice)
    })?;
    if !(1..=NAME_MAX).contains(&unit.name.chars().count()) {
        let message = format!(
            "the name has {} characters, expected 1 to {NAME_MAX}",
            unit.name.chars().count()
        );
        return Err((path.clone().field("name"), message));
    }
    let [least_jitter_s, _] = units.cooldown_jitter_s;
    unit.validate(least_jitter_s)
        .map_err(|error| broken(error.to_string()))?;
    Ok(unit)
}

/// Puts the values of `over` in place of those of `under`, table by table.
fn lay(under: &mut Table, over: Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(Value::Table(under)), Value::Table(over)) => lay(under, over),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

/// Checks that every number of a type is in its range, whatever statistics there are.
fn check_numbers(name: &str, table: &Table, path: &Path) -> Result<(), Broken> {
    for (key, value) in table {
        check_value((name, key), value, path.clone().field(key))?;
    }
    Ok(())
}

fn check_value((table, key): (&str, &str), value: &Value, path: Path) -> Result<(), Broken> {
    let number = match value {
        Value::Integer(number) => *number as f64,
        Value::Float(number) => *number,
        Value::Table(inner) => return check_numbers(key, inner, &path),
        Value::Array(array) if array.len() > ARRAY_MAX => {
            let message = format!(
                "{key} has {} elements, expected at most {ARRAY_MAX}",
                array.len()
            );
            return Err((path, message));
        }
        Value::Array(array) => {
            let items = array.iter().enumerate();
            return items.into_iter().try_for_each(|(index, item)| {
                check_value((table, key), item, path.clone().item(index))
            });
        }
        Value::String(_) | Value::Boolean(_) | Value::Datetime(_) => return Ok(()),
    };
    let tighter = RANGES
        .iter()
        .find(|(of, name, ..)| (*of, *name) == (table, key));
    let (least, greatest) = tighter.map_or(ANY_NUMBER, |(.., least, greatest)| (*least, *greatest));
    if (least..=greatest).contains(&number) {
        return Ok(());
    }
    let message = format!("{key} is {number}, expected a number in [{least}, {greatest}]");
    Err((path, message))
}

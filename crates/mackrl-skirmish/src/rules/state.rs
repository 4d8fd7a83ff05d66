//! The state of a battle: plain data.

use serde::{Deserialize, Serialize};

/// Position of a unit in the state's arrays.
pub type UnitIndex = u8;

/// The two sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Team {
    /// The side of the agents.
    Ally,
    /// The other side.
    Enemy,
}

/// Whether a unit fights without being told to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stance {
    /// Does exactly what it is ordered: it neither shoots nor chases nor answers attacks on its own.
    Passive,
    /// Scans for targets, fights them, answers attacks and calls for help.
    Aggressive,
}

/// What a unit was told to do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Stand. An aggressive unit fights what comes near.
    Stop,
    /// Walk to a point.
    Move {
        /// The point.
        to: [f32; 2],
    },
    /// Walk into weapon range of a unit and fight it until it is dead.
    Attack {
        /// The unit.
        target: UnitIndex,
    },
    /// Walk to a point and fight everything on the way (aggressive units only; passive ones just walk).
    AttackMove {
        /// The point.
        to: [f32; 2],
    },
    /// Fight the nearest unit of the other side, wherever it is.
    Hunt,
    /// Go near a friend and heal it until it is whole.
    Heal {
        /// The friend.
        target: UnitIndex,
    },
}

/// What a unit is, has and does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// Index of its type among the battlefield's profiles.
    pub kind: u8,
    /// Its side.
    pub team: Team,
    /// Whether it fights unasked.
    pub stance: Stance,
    /// Hit points; 0 if and only if dead.
    pub life: f32,
    /// Shield points.
    pub shield: f32,
    /// Energy; 0 for units that cast nothing.
    pub energy: f32,
    /// Map units a loop at which it moves, for units that gather speed.
    pub pace: f32,
    /// What it was told.
    pub order: Order,
    /// Whom an aggressive unit has chosen to fight, or to heal.
    pub quarry: Option<UnitIndex>,
    /// Where it stood when it chose its quarry.
    pub chase_from: [f32; 2],
    /// Loops until it looks for a better quarry.
    pub rescan: f32,
    /// Loops until the weapon is ready; in (−1, 0] if it became ready in this loop, by so much earlier.
    pub cooldown: f32,
    /// Loops since the attack under way began, before its damage point.
    pub swing: Option<f32>,
    /// Loops for which it stands after an attack.
    pub backswing: f32,
    /// Loops since it was last damaged.
    pub unharmed: f32,
    /// Loops until it can call for help again.
    pub call_wait: f32,
    /// Side on which it is walking round an obstacle: 1 left, −1 right, 0 neither.
    pub detour: i8,
    /// Loops for which it keeps that side.
    pub detour_loops: u8,
}

/// A missile in flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Missile {
    /// Where it is.
    pub x: f32,
    /// Where it is.
    pub y: f32,
    /// Whom it follows.
    pub target: UnitIndex,
    /// Who shot it, dead or alive.
    pub shooter: UnitIndex,
}

/// A later hit of an attack that has begun.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Blow {
    /// Loops until it lands.
    pub delay: f32,
    /// Whom it hits.
    pub target: UnitIndex,
    /// Who strikes; the blow is lost with its striker.
    pub striker: UnitIndex,
}

/// All that changes in a battle. Agents come first, in their order.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BattleState {
    /// Position of every unit, dead ones where they fell.
    pub x: Vec<f32>,
    /// Position of every unit.
    pub y: Vec<f32>,
    /// Everything else about every unit.
    pub units: Vec<Unit>,
    /// Missiles in flight, oldest first.
    pub missiles: Vec<Missile>,
    /// Blows to come, oldest first.
    pub blows: Vec<Blow>,
}

impl Team {
    /// The side that this one fights.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Ally => Self::Enemy,
            Self::Enemy => Self::Ally,
        }
    }
}

impl Unit {
    /// Whether it lives.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.life > 0.0
    }
}

impl BattleState {
    /// Square of the distance between the centres of two units.
    #[must_use]
    pub fn distance_squared(&self, a: usize, b: usize) -> f32 {
        let (dx, dy) = (self.x[b] - self.x[a], self.y[b] - self.y[a]);
        dx * dx + dy * dy
    }

    /// Number of living units of `team`.
    #[must_use]
    pub fn living(&self, team: Team) -> usize {
        self.units
            .iter()
            .filter(|unit| unit.team == team && unit.is_alive())
            .count()
    }

    /// A number that differs, but for chance, when any part of the state differs; the same on every machine.
    #[must_use]
    pub fn hash(&self) -> u64 {
        let mut hash = Fnv(0xCBF2_9CE4_8422_2325);
        for (unit, (x, y)) in self.units.iter().zip(self.x.iter().zip(&self.y)) {
            for number in [
                *x,
                *y,
                unit.life,
                unit.shield,
                unit.cooldown,
                unit.backswing,
            ] {
                hash.add(number.to_bits());
            }
            for number in [
                unit.unharmed,
                unit.call_wait,
                unit.rescan,
                unit.energy,
                unit.pace,
            ] {
                hash.add(number.to_bits());
            }
            hash.add(unit.swing.map_or(u32::MAX, f32::to_bits));
            hash.add(unit.quarry.map_or(u32::MAX, u32::from));
            hash.add_point(unit.chase_from);
            hash.add_order(unit.order);
            hash.add(u32::from(unit.detour.unsigned_abs()) << 9 | u32::from(unit.detour > 0) << 8);
            hash.add(u32::from(unit.detour_loops));
        }
        for missile in &self.missiles {
            hash.add(missile.x.to_bits());
            hash.add(missile.y.to_bits());
            hash.add(u32::from(missile.target) << 8 | u32::from(missile.shooter));
        }
        for blow in &self.blows {
            hash.add(blow.delay.to_bits());
            hash.add(u32::from(blow.target) << 8 | u32::from(blow.striker));
        }
        hash.0
    }
}

/// Fowler–Noll–Vo 1a over 32-bit words.
struct Fnv(u64);

impl Fnv {
    fn add(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x100_0000_01B3);
    }

    fn add_point(&mut self, [x, y]: [f32; 2]) {
        self.add(x.to_bits());
        self.add(y.to_bits());
    }

    fn add_order(&mut self, order: Order) {
        let (kind, numbers) = match order {
            Order::Stop => (0, [0.0; 2]),
            Order::Move { to } => (1, to),
            Order::Attack { target } => (2, [f32::from(target), 0.0]),
            Order::AttackMove { to } => (3, to),
            Order::Hunt => (4, [0.0; 2]),
            Order::Heal { target } => (5, [f32::from(target), 0.0]),
        };
        self.add(kind);
        self.add_point(numbers);
    }
}

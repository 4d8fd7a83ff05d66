//! What can go wrong in this library.

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::nn::ParameterLayout;

/// An error of this library.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting is unknown, out of range or impossible beside another.
    #[error("{0}")]
    Config(String),
    /// Stored data cannot be used: a damaged checkpoint, a wrong shape.
    #[error("{0}")]
    Data(String),
    /// A number that is not finite turned up.
    #[error(transparent)]
    NotFinite(Box<NotFinite>),
    /// Somebody asked to stop; what was begun was given up, and nothing has changed.
    #[error("stopped as asked")]
    Stopped,
    /// An environment refused an action, or failed for good.
    #[error(transparent)]
    Step(#[from] mackrl_env::StepError),
}

impl Error {
    /// That a setting has a value that it does not take.
    pub(crate) fn setting(error: mackrl_env::settings::SettingsError) -> Self {
        Self::Config(error.to_string())
    }
}

impl From<mackrl_env::WorldError> for Error {
    fn from(error: mackrl_env::WorldError) -> Self {
        Self::Config(error.to_string())
    }
}

/// A number that is infinite or NaN, and where it turned up.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotFinite {
    /// Where it turned up: `reward`, `logits of pair_controller`, `gradient of critic.input.weight`.
    pub tensor: String,
    /// Its place in the tensor: names of axes, and indices.
    pub place: Vec<(String, usize)>,
    /// Which of the numbers that are not finite it is.
    pub value: Broken,
    /// When, if it was in training.
    pub moment: Option<Moment>,
}

/// The numbers that are not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Broken {
    /// Not a number.
    NaN,
    /// ∞
    #[serde(rename = "inf")]
    Infinity,
    /// −∞
    #[serde(rename = "-inf")]
    NegativeInfinity,
}

/// A moment of training.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Moment {
    /// Policy updates before this one.
    pub update: u64,
    /// Environment steps before those that this update learns from.
    pub steps_env: u64,
}

impl NotFinite {
    /// At `place`, an index for each axis, of `tensor`.
    #[must_use]
    pub fn new(tensor: impl Into<String>, place: &[(&str, usize)], value: f32) -> Self {
        let place = place.iter();
        Self {
            tensor: tensor.into(),
            place: place.map(|(axis, at)| ((*axis).to_owned(), *at)).collect(),
            value: Broken::of(value),
            moment: None,
        }
    }

    /// At an index of a flat vector: of the tensor that lies there, after the words `what`, such as `gradient of`. Matrices are
    /// indexed as in checkpoints, outputs first.
    #[must_use]
    pub fn in_layout(what: &str, layout: &ParameterLayout, index: usize, values: &[f32]) -> Self {
        let Some(tensor) = layout.tensor_at(index) else {
            return Self::new(what, &[("index", index)], values[index]);
        };
        let within = index - tensor.range.start;
        let name = format!("{what} {}", tensor.name);
        match tensor.shape[..] {
            [outputs, _] => {
                let place = [("output", within % outputs), ("input", within / outputs)];
                Self::new(name, &place, values[index])
            }
            _ => Self::new(name, &[("output", within)], values[index]),
        }
    }

    /// The same number, with what it belongs to before its place.
    #[must_use]
    pub fn within(mut self, axis: &str, index: usize) -> Self {
        self.place.insert(0, (axis.to_owned(), index));
        self
    }

    /// The same number, with `by` added to its index along `axis`.
    #[must_use]
    pub(crate) fn shifted(mut self, axis: &str, by: usize) -> Self {
        let place = self.place.iter_mut().find(|(name, _)| name == axis);
        if let Some((_, index)) = place {
            *index += by;
        }
        self
    }

    /// The same number at a moment of training.
    #[must_use]
    pub fn at(mut self, moment: Moment) -> Self {
        self.moment = Some(moment);
        self
    }
}

impl Broken {
    /// The kind of a number that is not finite.
    #[must_use]
    pub const fn of(value: f32) -> Self {
        if value.is_nan() {
            Self::NaN
        } else if value > 0.0 {
            Self::Infinity
        } else {
            Self::NegativeInfinity
        }
    }
}

/// "TENSOR is VALUE at AXIS INDEX, …, at update U (environment step S)"
impl fmt::Display for NotFinite {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} is {}", self.tensor, self.value)?;
        for (number, (axis, index)) in self.place.iter().enumerate() {
            let before = if number == 0 { " at" } else { "," };
            write!(formatter, "{before} {axis} {index}")?;
        }
        match self.moment {
            Some(Moment { update, steps_env }) => write!(
                formatter,
                ", in update {update} after {steps_env} environment steps"
            ),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Broken {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NaN => "NaN",
            Self::Infinity => "inf",
            Self::NegativeInfinity => "-inf",
        })
    }
}

impl std::error::Error for NotFinite {}

impl From<NotFinite> for Error {
    fn from(broken: NotFinite) -> Self {
        Self::NotFinite(Box::new(broken))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_named_with_layer_place_and_moment() {
        let mut layout = ParameterLayout::new();
        layout.add("critic.input.weight", &[2, 3]);
        layout.add("critic.input.bias", &[2]);
        let mut values = [0.5; 8];
        // Stored as [inputs, outputs]: input 1 of output 0.
        values[2] = f32::NEG_INFINITY;
        values[7] = f32::NAN;
        let weight = NotFinite::in_layout("gradient of", &layout, 2, &values);
        assert_eq!(
            weight.to_string(),
            "gradient of critic.input.weight is -inf at output 0, input 1"
        );
        let moment = Moment {
            update: 7,
            steps_env: 240,
        };
        let bias = NotFinite::in_layout("second moment of", &layout, 7, &values).at(moment);
        assert_eq!(
            bias.to_string(),
            "second moment of critic.input.bias is NaN at output 1, in update 7 after 240 environment steps"
        );
        let reward = NotFinite::new("reward", &[("step", 3)], f32::INFINITY).within("episode", 5);
        assert_eq!(reward.to_string(), "reward is inf at episode 5, step 3");
        let json = serde_json::to_string(&bias).unwrap();
        assert_eq!(serde_json::from_str::<NotFinite>(&json).unwrap(), bias);
    }
}

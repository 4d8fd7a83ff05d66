//! Worlds as any program offers them: kinds that are chosen by name and configured by a table, and worlds that are built once
//! and copied.
//!
//! A [`WorldKind`] is what a configuration names: it declares its settings, and builds a [`World`] from a table of them. A
//! [`World`] is one such configured world: it says what it is, and makes as many [`Environment`]s as a run plays in. Between
//! the two lies the work of reading maps and checking settings, which is done once: an environment is a copy of a prototype.
//! A program that plays in worlds holds a list of kinds and looks into none of them, so an own world is one more entry.

use std::{
    borrow::Cow,
    fmt::{self, Debug},
    sync::Arc,
};

use thiserror::Error;

use crate::{
    Environment, EnvironmentSpec, InvalidSpec, PriorKnowledge,
    settings::{Setting, Settings, SettingsError},
};

/// A kind of world: what stands under a name in a program's list of worlds.
pub trait WorldKind: Send + Sync + Debug {
    /// By which configurations call it, such as `skirmish`: lower-case words joined by hyphens.
    fn name(&self) -> &str;

    /// What it is, in one line for a list of kinds.
    fn summary(&self) -> &str;

    /// Every setting with its meaning and the values that it takes, in the order in which they are listed to users.
    fn settings(&self) -> Vec<Setting>;

    /// The value of every setting that a table does not set, under the names of [`settings`](Self::settings).
    fn defaults(&self) -> toml::Table;

    /// Builds the world that `table` describes; settings that it leaves out have their default.
    ///
    /// # Errors
    /// [`WorldError`] names the setting, what was found and what was expected.
    fn build(&self, table: &toml::Table) -> Result<Arc<dyn World>, WorldError>;
}

/// One configured world, from which environments are made.
pub trait World: Send + Sync + Debug {
    /// [`WorldKind::name`] of its kind.
    fn kind(&self) -> &str;

    /// Which of its kind it is, such as `3m`.
    fn name(&self) -> &str {
        &self.spec().name
    }

    /// Sizes and limits of its environments.
    fn spec(&self) -> &EnvironmentSpec;

    /// What every agent knows before the first step.
    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge>;

    /// An environment that has played nothing, and that shares no state with any other.
    fn make(&self) -> Box<dyn Environment>;

    /// Version of its rules: raised whenever the same key and actions give another episode.
    fn version(&self) -> &str;

    /// The data that it is made of, as text: maps, tables of statistics. Settings stand in the configuration and rules in the
    /// code. Its hash tells whether two results were obtained in the same world.
    fn data(&self) -> &str;

    /// Environments that may be played in at once, if that is limited.
    fn parallel_max(&self) -> Option<usize> {
        None
    }

    /// What its environments have gone through so far, all together.
    fn counters(&self) -> Vec<Counter> {
        Vec::new()
    }
}

/// Something that a world counts, for reports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counter {
    /// Name, such as `game_launches`.
    pub name: Cow<'static, str>,
    /// What is counted.
    pub meaning: Cow<'static, str>,
    /// How many so far.
    pub value: u64,
}

/// Why a world could not be built.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WorldError {
    /// A setting is unknown, or has a value that it does not take.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The text that a setting holds is faulty inside.
    #[error("{problem}")]
    Text {
        /// Name of the setting.
        setting: String,
        /// Where in the text, what was found and what was expected.
        problem: String,
    },
    /// It is larger than can be played in, or declares itself wrongly.
    #[error(transparent)]
    Invalid(#[from] InvalidSpec),
    /// Something is missing or broken that no setting can mend.
    #[error("{0}")]
    Unavailable(String),
}

/// A world whose environments are copies of one that was built.
#[derive(Clone)]
pub struct Prototype<E> {
    kind: Cow<'static, str>,
    version: Cow<'static, str>,
    data: Cow<'static, str>,
    environment: E,
}

impl<E: Environment> Prototype<E> {
    /// The world of `environment`, of which nothing has been played yet; `kind` is the name of its kind.
    ///
    /// # Errors
    /// [`WorldError::Invalid`] if its sizes are none that a world can have.
    pub fn new(kind: impl Into<Cow<'static, str>>, environment: E) -> Result<Self, WorldError> {
        environment.spec().validate()?;
        Ok(Self {
            kind: kind.into(),
            version: Cow::Borrowed("1"),
            data: Cow::Borrowed(""),
            environment,
        })
    }

    /// With another [`World::version`] than 1.
    #[must_use]
    pub fn version(mut self, version: impl Into<Cow<'static, str>>) -> Self {
        self.version = version.into();
        self
    }

    /// With [`World::data`], which is empty otherwise.
    #[must_use]
    pub fn data(mut self, data: impl Into<Cow<'static, str>>) -> Self {
        self.data = data.into();
        self
    }
}

impl<E: Environment + Clone + Sync + 'static> World for Prototype<E> {
    fn kind(&self) -> &str {
        &self.kind
    }

    fn spec(&self) -> &EnvironmentSpec {
        self.environment.spec()
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        self.environment.prior_knowledge()
    }

    fn make(&self) -> Box<dyn Environment> {
        Box::new(self.environment.clone())
    }

    fn version(&self) -> &str {
        &self.version
    }

    fn data(&self) -> &str {
        &self.data
    }
}

impl<E: Environment> Debug for Prototype<E> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Prototype")
            .field("kind", &self.kind)
            .field("version", &self.version)
            .field("spec", self.environment.spec())
            .finish_non_exhaustive()
    }
}

/// A kind of world that is a struct of declared settings and a function that builds an environment from it.
///
/// This is the short way to a kind of one's own:
///
/// ```
/// use mackrl_env::{DeclaredKind, WorldKind, sanity::{Remember, RememberSettings}};
///
/// let kind = DeclaredKind::new("remember", "say again what was shown at first", |settings: RememberSettings| {
///     Ok(Remember::new(settings))
/// });
/// let world = kind.build(&"delay = 4".parse().unwrap()).unwrap();
/// assert_eq!(world.spec().episode_limit, 5);
/// let refused = kind.build(&"delay = -1".parse().unwrap()).unwrap_err();
/// assert_eq!(refused.to_string(), "setting `delay` is -1, expected an integer in [0, 1000]");
/// ```
pub struct DeclaredKind<S, E> {
    name: &'static str,
    summary: &'static str,
    build: fn(S) -> Result<E, WorldError>,
}

impl<S: Settings, E: Environment + Clone + Sync + 'static> DeclaredKind<S, E> {
    /// The kind called `name`, whose environments `build` makes.
    #[must_use]
    pub const fn new(
        name: &'static str,
        summary: &'static str,
        build: fn(S) -> Result<E, WorldError>,
    ) -> Self {
        Self {
            name,
            summary,
            build,
        }
    }
}

impl<S: Settings, E: Environment + Clone + Sync + 'static> WorldKind for DeclaredKind<S, E> {
    fn name(&self) -> &str {
        self.name
    }

    fn summary(&self) -> &str {
        self.summary
    }

    fn settings(&self) -> Vec<Setting> {
        S::DECLARED.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        S::defaults()
    }

    fn build(&self, table: &toml::Table) -> Result<Arc<dyn World>, WorldError> {
        let environment = (self.build)(S::read(table)?)?;
        Ok(Arc::new(Prototype::new(self.name, environment)?))
    }
}

impl<S, E> Debug for DeclaredKind<S, E> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("DeclaredKind")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

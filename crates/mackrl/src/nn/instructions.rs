//! Which instructions the kernels run on: the widest of the machine, or those that `MACKRL_SIMD` names.
//!
//! There is one dispatcher. To force a set changes which of its branches is taken, never the branch: what runs on AVX2
//! because AVX-512 was refused is what runs on a machine without AVX-512. The choice is made once in a process, for the
//! features of a machine do not change and a kernel may be as short as one exponential.

use std::{fmt, sync::OnceLock};

use pulp::Simd;
use thiserror::Error;

use crate::nn::lanes::{Kernel, Vectors};

/// The instructions that the kernels of `f32` run on. They decide how fast a number comes, never which number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum InstructionSet {
    /// One number at a time, on every machine.
    Scalar,
    /// 8 numbers at a time: AVX2 and fused multiply-add of x86-64-v3.
    Avx2,
    /// 16 numbers at a time: AVX-512 of x86-64-v4.
    Avx512,
    /// 4 numbers at a time: every 64-bit ARM.
    Neon,
}

/// `MACKRL_SIMD` names instructions that cannot be had.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{variable}={asked}: expected {available}, the instruction sets of this machine", variable = InstructionSet::VARIABLE)]
pub struct UnknownInstructionSet {
    asked: String,
    /// "scalar, avx2 or avx512"
    available: String,
}

impl InstructionSet {
    /// The environment variable that names the set to be used, instead of the widest.
    pub const VARIABLE: &str = "MACKRL_SIMD";

    /// Every set there is, the widest of a machine last.
    const ALL: [Self; 4] = [Self::Scalar, Self::Neon, Self::Avx2, Self::Avx512];

    /// The set that every kernel of this process runs on.
    ///
    /// # Errors
    /// [`UnknownInstructionSet`] if [`VARIABLE`](Self::VARIABLE) names none of this machine's sets. A kernel then panics with
    /// that message, so a program asks here first.
    pub fn chosen() -> Result<Self, UnknownInstructionSet> {
        match chosen_branch() {
            Ok(branch) => Ok(branch.set()),
            Err(error) => Err(error.clone()),
        }
    }

    /// The sets of this machine, the widest last.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL
            .into_iter()
            .filter(|set| Branch::of(*set).is_some())
    }

    /// `scalar`, `avx2`, `avx512` or `neon`, as [`VARIABLE`](Self::VARIABLE) takes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
        }
    }
}

impl fmt::Display for InstructionSet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// A branch of the dispatcher, with the proof that the machine can take it.
#[derive(Debug, Clone, Copy)]
enum Branch {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    #[cfg(target_arch = "x86_64")]
    Avx512(pulp::x86::V4),
    #[cfg(target_arch = "aarch64")]
    Neon(pulp::aarch64::Neon),
}

impl Branch {
    /// The branch of a set, if the machine has it.
    fn of(set: InstructionSet) -> Option<Self> {
        match set {
            InstructionSet::Scalar => Some(Self::Scalar),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => pulp::x86::V3::try_new().map(Self::Avx2),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => pulp::x86::V4::try_new().map(Self::Avx512),
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => pulp::aarch64::Neon::try_new().map(Self::Neon),
            #[allow(unreachable_patterns, reason = "some sets are another machine's")]
            _ => None,
        }
    }

    const fn set(self) -> InstructionSet {
        match self {
            Self::Scalar => InstructionSet::Scalar,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => InstructionSet::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => InstructionSet::Avx512,
            #[cfg(target_arch = "aarch64")]
            Self::Neon(_) => InstructionSet::Neon,
        }
    }

    /// What was asked for, or the widest if nothing was.
    fn choose(asked: Option<&str>) -> Result<Self, UnknownInstructionSet> {
        let mut available = InstructionSet::ALL.into_iter().filter_map(Self::of);
        let found = match asked {
            None => available.next_back(),
            Some(name) => available.find(|branch| branch.set().name() == name),
        };
        found.ok_or_else(|| UnknownInstructionSet {
            asked: asked.unwrap_or_default().to_owned(),
            available: listed(InstructionSet::available()),
        })
    }
}

/// Runs a kernel on the chosen instructions.
///
/// # Panics
/// If [`InstructionSet::chosen`] is an error.
#[inline]
pub(super) fn dispatch<K: Kernel<f32>>(kernel: K) -> K::Output {
    match current_branch() {
        Branch::Scalar => Simd::vectorize(pulp::Scalar, Vectorised(kernel)),
        #[cfg(target_arch = "x86_64")]
        Branch::Avx2(simd) => Simd::vectorize(simd, Vectorised(kernel)),
        #[cfg(target_arch = "x86_64")]
        Branch::Avx512(simd) => Simd::vectorize(simd, Vectorised(kernel)),
        #[cfg(target_arch = "aarch64")]
        Branch::Neon(simd) => Simd::vectorize(simd, Vectorised(kernel)),
    }
}

/// Lets `pulp` run a kernel.
struct Vectorised<K>(K);

impl<K: Kernel<f32>> pulp::WithSimd for Vectorised<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> K::Output {
        self.0.run(Vectors(simd))
    }
}

/// The branch of the process; where a test asks for another one, that of this thread.
#[inline]
fn current_branch() -> Branch {
    #[cfg(test)]
    if let Some(branch) = FORCED.get() {
        return branch;
    }
    match chosen_branch() {
        Ok(branch) => *branch,
        Err(error) => refuse(error),
    }
}

#[inline]
fn chosen_branch() -> &'static Result<Branch, UnknownInstructionSet> {
    static CHOSEN: OnceLock<Result<Branch, UnknownInstructionSet>> = OnceLock::new();
    CHOSEN.get_or_init(|| {
        let asked = std::env::var_os(InstructionSet::VARIABLE);
        let asked = asked.as_ref().map(|asked| asked.to_string_lossy());
        Branch::choose(asked.as_deref())
    })
}

#[cold]
fn refuse(error: &UnknownInstructionSet) -> ! {
    panic!("{error}")
}

/// "a, b or c"
fn listed(sets: impl Iterator<Item = InstructionSet>) -> String {
    let names: Vec<&str> = sets.map(InstructionSet::name).collect();
    match names.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

#[cfg(test)]
thread_local! {
    static FORCED: std::cell::Cell<Option<Branch>> = const { std::cell::Cell::new(None) };
}

/// Computes something on one of this machine's instruction sets: the dispatcher takes that set's branch on this thread.
#[cfg(test)]
pub(crate) fn on<T>(set: InstructionSet, compute: impl FnOnce() -> T) -> T {
    let branch = Branch::of(set).expect("a set of this machine");
    let before = FORCED.replace(Some(branch));
    let result = compute();
    FORCED.set(before);
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::lanes::{Element, Lanes};

    /// How many numbers a vector has.
    struct Width;

    impl Kernel<f32> for Width {
        type Output = usize;

        fn run<L: Lanes<Element = f32>>(self, _: L) -> usize {
            L::LANES
        }
    }

    const fn width(set: InstructionSet) -> usize {
        match set {
            InstructionSet::Scalar => 1,
            InstructionSet::Neon => 4,
            InstructionSet::Avx2 => 8,
            InstructionSet::Avx512 => 16,
        }
    }

    /// What the standard library says of the machine.
    #[cfg(target_arch = "x86_64")]
    fn widest_of_machine() -> InstructionSet {
        let has_avx512 = std::is_x86_feature_detected!("avx512f")
            && std::is_x86_feature_detected!("avx512bw")
            && std::is_x86_feature_detected!("avx512cd")
            && std::is_x86_feature_detected!("avx512dq")
            && std::is_x86_feature_detected!("avx512vl");
        if has_avx512 {
            InstructionSet::Avx512
        } else if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
            InstructionSet::Avx2
        } else {
            InstructionSet::Scalar
        }
    }

    #[cfg(target_arch = "aarch64")]
    fn widest_of_machine() -> InstructionSet {
        InstructionSet::Neon
    }

    #[test]
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    fn kernels_run_on_the_widest_instructions_of_the_machine_unless_others_are_asked_for() {
        let widest = Branch::choose(None).unwrap().set();
        assert_eq!(widest, widest_of_machine());
        let asked = std::env::var(InstructionSet::VARIABLE);
        let expected = asked.as_deref().unwrap_or(widest.name());
        assert_eq!(InstructionSet::chosen().unwrap().name(), expected);
        let chosen = InstructionSet::chosen().unwrap();
        assert_eq!(f32::dispatch(Width), width(chosen));
    }

    #[test]
    fn every_set_of_the_machine_can_be_asked_for_and_is_what_kernels_run_on() {
        for set in InstructionSet::available() {
            assert_eq!(Branch::choose(Some(set.name())).unwrap().set(), set);
            assert_eq!(on(set, || f32::dispatch(Width)), width(set), "{set}");
        }
        assert_eq!(
            InstructionSet::available().next(),
            Some(InstructionSet::Scalar)
        );
    }

    #[test]
    fn a_set_that_cannot_be_had_is_refused_with_those_that_can() {
        let mut foreign = InstructionSet::ALL.into_iter();
        let foreign = foreign.find(|set| Branch::of(*set).is_none());
        let foreign = foreign.expect("no machine has AVX2 and NEON").name();
        for asked in ["avx1024", "AVX2", "", foreign] {
            let error = Branch::choose(Some(asked)).unwrap_err().to_string();
            let expected = listed(InstructionSet::available());
            assert_eq!(
                error,
                format!(
                    "MACKRL_SIMD={asked}: expected {expected}, the instruction sets of this machine"
                )
            );
        }
    }

    #[test]
    fn names_are_listed_as_a_sentence_lists_them() {
        let [a, b, c, _] = InstructionSet::ALL;
        assert_eq!(listed([a].into_iter()), "scalar");
        assert_eq!(listed([a, b, c].into_iter()), "scalar, neon or avx2");
    }
}

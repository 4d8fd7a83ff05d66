//! What the team earns for each joint action.
//!
//! The paper prints one pair of matrices (its Figures 3 and 4) and the published code holds another, in which one of the two
//! best cells of each matrix is worth nothing. Every optimum is the same for both, learning is not: a learner that has one
//! good cell instead of two finds it less often. The published curves were made with the coded pair.

use serde::{Deserialize, Serialize};

use crate::declare_words;

/// A: actions of an agent.
pub const ACTIONS: usize = 5;

/// In fifths, as rows over the first agent's action and columns over the second's.
type Fifths = [[u8; ACTIONS]; ACTIONS];

const PRINTED: [Fifths; 2] = [
    [
        [5, 0, 0, 2, 0],
        [0, 1, 2, 4, 2],
        [0, 0, 0, 2, 0],
        [0, 0, 0, 1, 0],
        [0, 0, 0, 0, 5],
    ],
    [
        [0, 0, 1, 0, 5],
        [0, 0, 2, 0, 0],
        [1, 2, 4, 2, 1],
        [0, 0, 2, 0, 0],
        [5, 0, 1, 0, 0],
    ],
];

/// The cell (row, column) of each matrix that the published code sets to zero.
const ZEROED: [(usize, usize); 2] = [(4, 4), (4, 0)];

/// Which of the two games is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Matrix {
    /// The paper's Figure 3.
    A,
    /// The paper's Figure 4.
    B,
}

impl Matrix {
    /// Both matrices.
    pub const ALL: [Self; 2] = [Self::A, Self::B];

    /// Position in arrays over matrices.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::A => 0,
            Self::B => 1,
        }
    }
}

declare_words! {
    /// Which pair of matrices is meant.
    pub enum Payoffs {
        /// As in the published code, with which the published figure was made.
        #[default]
        Coded = "coded",
        /// As printed in the paper.
        Printed = "printed",
    }
}

/// What the team earns in `matrix` for the joint action `(first, second)`, in [0, 1].
///
/// # Panics
/// If an action is not below [`ACTIONS`].
#[must_use]
pub fn payoff(payoffs: Payoffs, matrix: Matrix, first: usize, second: usize) -> f64 {
    let zeroed = payoffs == Payoffs::Coded && ZEROED[matrix.index()] == (first, second);
    if zeroed {
        return 0.0;
    }
    f64::from(PRINTED[matrix.index()][first][second]) / 5.0
}

/// Both matrices as text: a line for each row, first those of A, then those of B.
#[must_use]
pub fn payoff_text(payoffs: Payoffs) -> String {
    let mut text = String::new();
    for matrix in Matrix::ALL {
        for first in 0..ACTIONS {
            let row = (0..ACTIONS).map(|second| payoff(payoffs, matrix, first, second).to_string());
            text.push_str(&row.collect::<Vec<_>>().join(" "));
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn total(payoffs: Payoffs, matrix: Matrix) -> f64 {
        (0..ACTIONS * ACTIONS)
            .map(|cell| payoff(payoffs, matrix, cell / ACTIONS, cell % ACTIONS))
            .sum()
    }

    #[test]
    fn printed_matrices_have_two_best_cells_and_coded_ones_a_single_one() {
        for (payoffs, best_cells) in [(Payoffs::Printed, 2), (Payoffs::Coded, 1)] {
            for matrix in Matrix::ALL {
                let found = (0..ACTIONS * ACTIONS)
                    .filter(|cell| payoff(payoffs, matrix, cell / ACTIONS, cell % ACTIONS) == 1.0)
                    .count();
                assert_eq!(found, best_cells, "{payoffs:?} {matrix:?}");
            }
        }
    }

    #[test]
    fn the_pairs_differ_in_one_best_cell_of_each_matrix() {
        for matrix in Matrix::ALL {
            let difference = total(Payoffs::Printed, matrix) - total(Payoffs::Coded, matrix);
            assert!((difference - 1.0).abs() < 1e-12, "{matrix:?}: {difference}");
        }
        assert_eq!(payoff(Payoffs::Coded, Matrix::A, 4, 4), 0.0);
        assert_eq!(payoff(Payoffs::Coded, Matrix::B, 4, 0), 0.0);
    }

    #[test]
    fn rows_belong_to_the_first_agent() {
        assert_eq!(payoff(Payoffs::Printed, Matrix::A, 1, 3), 0.8);
        assert_eq!(payoff(Payoffs::Printed, Matrix::A, 3, 1), 0.0);
        assert_eq!(payoff(Payoffs::Printed, Matrix::B, 2, 4), 0.2);
        assert_eq!(payoff(Payoffs::Printed, Matrix::B, 4, 2), 0.2);
    }
}

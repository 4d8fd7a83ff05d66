//! The matrix game as the learners see it: every deal with its probability, and the payoffs as a table.

use mackrl_env::matrix_game::{
    ACTIONS, Deal, InvalidProbability, Matrix, ObservationDistribution, Payoffs, payoff,
};

/// Payoffs of one matrix over both actions \[A, A\], the first agent's outermost.
pub(super) type PayoffTable = [[f64; ACTIONS]; ACTIONS];

/// One matrix game: payoffs, information structure and the probability of common knowledge.
#[derive(Debug, Clone, PartialEq)]
pub struct TabularGame {
    deals: Vec<Deal>,
    tables: [PayoffTable; 2],
}

impl TabularGame {
    /// Enumerates the game at probability of common knowledge `p`.
    ///
    /// # Errors
    /// If `p` is not in [0, 1].
    pub fn new(
        payoffs: Payoffs,
        distribution: ObservationDistribution,
        p: f64,
    ) -> Result<Self, InvalidProbability> {
        let table = |matrix| {
            let row = |first| std::array::from_fn(|second| payoff(payoffs, matrix, first, second));
            std::array::from_fn(row)
        };
        Ok(Self {
            deals: distribution.deals(p)?,
            tables: Matrix::ALL.map(table),
        })
    }

    /// Every deal that can happen; their probabilities sum to 1.
    #[must_use]
    pub fn deals(&self) -> &[Deal] {
        &self.deals
    }

    /// R(u¹, u²) of `matrix`.
    pub(super) const fn payoffs(&self, matrix: Matrix) -> &PayoffTable {
        &self.tables[matrix.index()]
    }
}

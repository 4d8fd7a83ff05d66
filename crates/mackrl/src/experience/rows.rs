//! What one bank of controllers read, step after step: one row for each group that still acts.
//!
//! Rows may leave between steps; those that stay continue the row that they had. All steps lie one after the other, however
//! many rows each has: products over whole steps or many steps see one matrix.

use std::ops::Range;

use crate::{nn::BEGINS, policy::Recording};

/// No row.
const ABSENT: usize = usize::MAX;

/// Whose row it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Instance {
    /// b: the environment.
    pub environment: usize,
    /// The group's number within its level.
    pub group: usize,
}

/// The rows of one step among those of all steps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StepRows {
    /// All rows: their inputs, and the rows that they continue.
    pub rows: Range<usize>,
    /// Those that were asked for a choice: their masks.
    pub asked: Range<usize>,
    /// Whether row i continues row i of the step before, for every i.
    pub unchanged: bool,
}

/// The inputs and masks of a bank of controllers.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    inputs: usize,
    columns: usize,
    groups: usize,
    /// Whether only some rows are asked for a choice at a step.
    selective: bool,
    /// Whether rows may join after the first step.
    joining: bool,
    recording: Recording,
    steps_begun: usize,
    steps: Vec<StepRows>,
    input_rf: Vec<f32>,
    mask_rc: Vec<bool>,
    instance_r: Vec<Instance>,
    carry_r: Vec<usize>,
    asked_r: Vec<usize>,
    /// The row of each instance at this step and at the one before, [`ABSENT`] for those that have left.
    row_of: Vec<usize>,
    previous_row_of: Vec<usize>,
    /// The place of each row of this step among those that are asked, or [`ABSENT`].
    place_of: Vec<usize>,
}

impl Rows {
    /// Room for a bank whose level has `groups` groups, with rows of `inputs` numbers and choices of `columns`. If it is
    /// `selective`, all rows advance their recurrence at every step but only some are asked for a choice.
    #[must_use]
    pub fn new([groups, inputs, columns]: [usize; 3], selective: bool) -> Self {
        Self {
            inputs,
            columns,
            groups,
            selective,
            joining: false,
            recording: Recording::Off,
            steps_begun: 0,
            steps: Vec::new(),
            input_rf: Vec::new(),
            mask_rc: Vec::new(),
            instance_r: Vec::new(),
            carry_r: Vec::new(),
            asked_r: Vec::new(),
            row_of: Vec::new(),
            previous_row_of: Vec::new(),
            place_of: Vec::new(),
        }
    }

    /// The same room for a bank whose rows may come and go: one that was not there at the step before begins anew.
    #[must_use]
    pub const fn that_may_join(mut self) -> Self {
        self.joining = true;
        self
    }

    /// F: length of a row of inputs.
    #[must_use]
    pub const fn inputs(&self) -> usize {
        self.inputs
    }

    /// C: length of a row of masks.
    #[must_use]
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// Whether only some rows are asked for a choice at a step.
    #[must_use]
    pub const fn is_selective(&self) -> bool {
        self.selective
    }

    /// T: how many steps were begun.
    #[must_use]
    pub const fn steps_begun(&self) -> usize {
        self.steps_begun
    }

    /// The steps that are kept: all of them if they are recorded for learning, else the latest.
    #[must_use]
    pub fn steps(&self) -> &[StepRows] {
        &self.steps
    }

    /// The inputs of all rows that are kept \[R, F\].
    #[must_use]
    pub fn input_rf(&self) -> &[f32] {
        &self.input_rf
    }

    /// The inputs of one step's rows \[rows, F\].
    #[must_use]
    pub fn inputs_of(&self, step: &StepRows) -> &[f32] {
        &self.input_rf[step.rows.start * self.inputs..step.rows.end * self.inputs]
    }

    /// The masks of one step's rows that were asked \[asked, C\].
    #[must_use]
    pub fn masks_of(&self, step: &StepRows) -> &[bool] {
        &self.mask_rc[step.asked.start * self.columns..step.asked.end * self.columns]
    }

    /// Whose each row of a step is.
    #[must_use]
    pub fn instances_of(&self, step: &StepRows) -> &[Instance] {
        &self.instance_r[step.rows.clone()]
    }

    /// For each row of a step, the row of the step before that it continues, or [`BEGINS`].
    #[must_use]
    pub fn carry_of(&self, step: &StepRows) -> &[usize] {
        &self.carry_r[step.rows.clone()]
    }

    /// For each row of a step that was asked, its number within the step.
    #[must_use]
    pub fn asked_of(&self, step: &StepRows) -> &[usize] {
        &self.asked_r[step.asked.clone()]
    }

    /// Forgets all steps.
    pub fn begin(&mut self, recording: Recording) {
        self.recording = recording;
        self.steps_begun = 0;
        self.forget();
        self.row_of.clear();
        self.previous_row_of.clear();
    }

    fn forget(&mut self) {
        self.steps.clear();
        self.input_rf.clear();
        self.mask_rc.clear();
        self.instance_r.clear();
        self.carry_r.clear();
        self.asked_r.clear();
    }

    /// Begins a step with one row for each of `instances`, ascending; its inputs are zero and its masks all false until they are
    /// written. An instance that was there before goes on where it was; after the first step, none joins unless they may. `is_asked`
    /// says which are asked for a choice, if the bank is selective.
    ///
    /// # Panics
    /// If an instance joins after the first step.
    pub fn begin_step(
        &mut self,
        instances: impl IntoIterator<Item = Instance>,
        mut is_asked: impl FnMut(Instance) -> bool,
    ) {
        let rows_before = self.steps.last().map_or(0, |step| step.rows.len());
        if self.recording == Recording::Off {
            self.forget();
        }
        std::mem::swap(&mut self.row_of, &mut self.previous_row_of);
        self.row_of.clear();
        self.place_of.clear();
        let (first, first_asked) = (self.instance_r.len(), self.asked_r.len());
        let is_first = self.steps_begun == 0;
        for (row, instance) in instances.into_iter().enumerate() {
            let number = instance.environment * self.groups + instance.group;
            if self.row_of.len() <= number {
                self.row_of.resize(number + 1, ABSENT);
            }
            self.row_of[number] = row;
            let before = self.previous_row_of.get(number).copied().unwrap_or(ABSENT);
            assert!(
                is_first || self.joining || before != ABSENT,
                "no controller joins after the first step of an episode"
            );
            self.carry_r.push(match before {
                _ if is_first => row,
                ABSENT => BEGINS,
                before => before,
            });
            self.instance_r.push(instance);
            let asked = !self.selective || is_asked(instance);
            self.place_of.push(if asked {
                self.asked_r.len() - first_asked
            } else {
                ABSENT
            });
            if asked {
                self.asked_r.push(row);
            }
        }
        let rows = first..self.instance_r.len();
        let asked = first_asked..self.asked_r.len();
        let carry = &self.carry_r[rows.clone()];
        let unchanged =
            is_first || rows.len() == rows_before && carry.iter().enumerate().all(|(i, &c)| i == c);
        self.input_rf.resize(rows.end * self.inputs, 0.0);
        self.mask_rc.resize(asked.end * self.columns, false);
        self.steps.push(StepRows {
            rows,
            asked,
            unchanged,
        });
        self.steps_begun += 1;
    }

    /// The latest step.
    ///
    /// # Panics
    /// If no step was begun.
    #[must_use]
    pub fn latest(&self) -> &StepRows {
        self.steps.last().expect("a step was begun")
    }

    /// The input and the mask of a row of the latest step, to be filled. A row that is not asked for its choice has no mask.
    ///
    /// # Shapes
    /// Input \[F\], mask \[C\].
    ///
    /// # Panics
    /// If no step was begun, or it has no such row.
    pub fn row_mut(&mut self, row: usize) -> (&mut [f32], Option<&mut [bool]>) {
        let place = self.place(row);
        let step = self.steps.last().expect("a step was begun");
        let first = (step.rows.start + row) * self.inputs;
        let input = &mut self.input_rf[first..first + self.inputs];
        let mask = place.map(|place| {
            let first = (step.asked.start + place) * self.columns;
            &mut self.mask_rc[first..first + self.columns]
        });
        (input, mask)
    }

    /// What a row of the latest step reads \[F\].
    #[must_use]
    pub fn input(&self, row: usize) -> &[f32] {
        let first = (self.latest().rows.start + row) * self.inputs;
        &self.input_rf[first..first + self.inputs]
    }

    /// The place of a row of the latest step among those that are asked, if it is.
    #[must_use]
    pub fn place(&self, row: usize) -> Option<usize> {
        let place = self.place_of.get(row).copied();
        place.filter(|&place| place != ABSENT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(rows: &mut Rows, groups: &[usize], asked: &[usize]) {
        let instances = groups.iter().map(|&group| Instance {
            environment: 0,
            group,
        });
        rows.begin_step(instances, |instance| asked.contains(&instance.group));
    }

    #[test]
    fn rows_that_stay_continue_the_row_that_they_had() {
        let mut rows = Rows::new([5, 2, 3], false);
        rows.begin(Recording::ForLearning);
        step(&mut rows, &[0, 1, 4], &[]);
        step(&mut rows, &[1, 4], &[]);
        step(&mut rows, &[1, 4], &[]);
        let steps = rows.steps();
        assert_eq!(rows.carry_of(&steps[1]), [1, 2]);
        assert_eq!(rows.carry_of(&steps[2]), [0, 1]);
        assert_eq!(
            steps.iter().map(|step| step.unchanged).collect::<Vec<_>>(),
            [true, false, true]
        );
        assert_eq!(
            (steps[2].rows.clone(), steps[2].asked.clone()),
            (5..7, 5..7)
        );
    }

    #[test]
    fn only_rows_that_are_asked_have_masks() {
        let mut rows = Rows::new([5, 2, 3], true);
        rows.begin(Recording::ForLearning);
        step(&mut rows, &[0, 1, 4], &[4, 0]);
        assert_eq!(rows.asked_of(rows.latest()), [0, 2]);
        rows.row_mut(2).1.expect("row 2 is asked")[1] = true;
        assert!(rows.row_mut(1).1.is_none(), "row 1 is not");
        step(&mut rows, &[0, 1], &[1]);
        rows.row_mut(1).0.fill(1.0);
        let [first, second] = rows.steps() else {
            panic!("two steps");
        };
        assert_eq!(
            rows.masks_of(first),
            [false, false, false, false, true, false]
        );
        assert_eq!(rows.inputs_of(second), [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(rows.masks_of(second), [false; 3]);
    }

    #[test]
    fn without_learning_the_latest_step_alone_is_kept() {
        let mut rows = Rows::new([5, 2, 3], false);
        rows.begin(Recording::Off);
        for groups in [&[0, 1, 4][..], &[0, 4], &[4]] {
            step(&mut rows, groups, &[]);
            assert_eq!(
                (rows.steps().len(), rows.input_rf().len()),
                (1, 2 * groups.len())
            );
        }
        assert_eq!(
            (rows.steps_begun(), rows.carry_of(rows.latest())),
            (3, &[1][..])
        );
    }

    #[test]
    fn rows_that_may_join_begin_anew_where_they_were_not_before() {
        let mut rows = Rows::new([5, 2, 3], false).that_may_join();
        rows.begin(Recording::ForLearning);
        for groups in [&[0, 1][..], &[1, 4], &[0, 4], &[0, 4]] {
            step(&mut rows, groups, &[]);
        }
        let carries = rows.steps().iter().map(|step| rows.carry_of(step).to_vec());
        let expected = [[0, 1], [1, BEGINS], [BEGINS, 1], [0, 1]].map(|carry| carry.to_vec());
        assert_eq!(carries.collect::<Vec<_>>(), expected);
        let unchanged: Vec<_> = rows.steps().iter().map(|step| step.unchanged).collect();
        assert_eq!(unchanged, [true, false, false, true]);
    }

    #[test]
    #[should_panic(expected = "no controller joins after the first step")]
    fn a_controller_that_joins_late_is_refused() {
        let mut rows = Rows::new([5, 2, 3], false);
        rows.begin(Recording::Off);
        step(&mut rows, &[0], &[]);
        step(&mut rows, &[0, 1], &[]);
    }
}

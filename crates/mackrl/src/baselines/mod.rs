//! Central-V and independent actors: the learners that MACKRL is measured against.

//! StarCraft micromanagement: the rules of battle and their reinforcement-learning face.

//! What an explanation says of some agents only.

use super::{Controllers, Explanation};

/// Whom an explanation is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum About {
    /// Everything.
    All,
    /// Groups of which all members are among these agents.
    Group(Vec<String>),
    /// This agent, and groups that it is in.
    Agent(String),
}

impl About {
    fn concerns(&self, members: &[impl AsRef<str>]) -> bool {
        match self {
            Self::All => true,
            Self::Group(agents) => members
                .iter()
                .all(|member| agents.iter().any(|agent| agent == member.as_ref())),
            Self::Agent(agent) => members.iter().any(|member| member.as_ref() == agent),
        }
    }
}

impl Explanation {
    /// The same without what does not concern these agents; partitions and probabilities of the whole team stay.
    pub(crate) fn only(mut self, about: &About) -> Self {
        self.views.retain(|view| about.concerns(&[&view.agent]));
        self.knowledge
            .retain(|knowledge| about.concerns(&knowledge.group));
        self.actions.retain(|taken| about.concerns(&[&taken.agent]));
        if let Some(controllers) = &mut self.controllers {
            controllers.keep(about);
        }
        self
    }
}

impl Controllers {
    fn keep(&mut self, about: &About) {
        let team = self.team.take();
        self.team = team.filter(|team| about.concerns(&team.members));
        self.pairs.retain(|pair| about.concerns(&pair.members));
        self.agents.retain(|agent| about.concerns(&[&agent.agent]));
        self.path.retain(|chosen| {
            let members: Vec<&str> = chosen.controller.split(", ").collect();
            chosen.controller == super::PARTITION || about.concerns(&members)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_about_its_subsets_and_an_agent_about_all_that_it_is_in() {
        let group = About::Group(["A", "B", "C"].map(str::to_owned).to_vec());
        assert!(group.concerns(&["A", "C"]) && group.concerns(&["B"]));
        assert!(!group.concerns(&["A", "D"]) && !group.concerns(&["D"]));
        let agent = About::Agent("A".to_owned());
        assert!(agent.concerns(&["A", "D"]) && agent.concerns(&["A"]));
        assert!(!agent.concerns(&["B", "C"]));
        assert!(About::All.concerns(&["Z"]));
    }
}

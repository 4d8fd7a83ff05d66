//! The fenced blocks of a page.

/// What the comment above a block says of it.
#[derive(Debug)]
pub(crate) enum Directive {
    NotRun(String),
    With(Vec<(String, String)>),
    /// Its name, and what is replaced in it.
    File(String, Vec<(String, String)>),
    /// First and last line of what was printed, from 1; all of it without.
    Output(Option<(usize, usize)>),
    From(String),
}

#[derive(Debug)]
pub(crate) struct Block {
    /// The word behind the fence.
    pub(crate) language: String,
    /// Its lines, each with its end.
    pub(crate) text: String,
    /// The line of its fence in the page, from 1.
    pub(crate) line: usize,
    pub(crate) directive: Option<Directive>,
}

impl Block {
    /// The text with what its directive replaces.
    ///
    /// # Panics
    /// If something is to be replaced that is not there.
    pub(crate) fn to_run(&self) -> String {
        let mut text = self.text.clone();
        if let Some(Directive::With(replaced) | Directive::File(_, replaced)) = &self.directive {
            for (from, to) in replaced {
                assert!(
                    text.contains(from),
                    "line {}: no `{from}` to replace",
                    self.line
                );
                text = text.replace(from, to);
            }
        }
        text
    }
}

/// All blocks of a page, in its order.
pub(crate) fn blocks(page: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut above = "";
    let mut lines = page.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let inside = lines.by_ref().map(|(_, line)| line);
            let inside = inside.take_while(|line| !line.starts_with("```"));
            found.push(Block {
                // rustdoc knows words behind a comma.
                language: language.split(',').next().unwrap_or_default().to_owned(),
                text: inside.map(|line| format!("{line}\n")).collect(),
                line: number + 1,
                directive: directive(above),
            });
        }
        above = line;
    }
    found
}

fn directive(line: &str) -> Option<Directive> {
    let inner = line.strip_prefix("<!-- ")?.strip_suffix(" -->")?;
    let (word, rest) = inner.split_once(": ").unwrap_or((inner, ""));
    Some(match word {
        "not run" => Directive::NotRun(rest.to_owned()),
        "with" => Directive::With(rest.split("; ").map(replaced).collect()),
        "file" => {
            let mut parts = rest.split("; ");
            let name = parts.next().unwrap_or_default().to_owned();
            Directive::File(name, parts.map(replaced).collect())
        }
        "output" => Directive::Output(rest.split_once('-').map(|(first, last)| {
            let number = |text: &str| text.parse().expect("the number of a line");
            (number(first), number(last))
        })),
        "from" => Directive::From(rest.to_owned()),
        _ => panic!("a block's comment says `{inner}`"),
    })
}

fn replaced(pair: &str) -> (String, String) {
    let (from, to) = pair.split_once(" = ").expect("FROM = TO");
    (from.to_owned(), to.to_owned())
}

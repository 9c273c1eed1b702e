//! Light path expressions: regular expressions over what happens along a path (Heckbert 1990; the notation is that of
//! Open Shading Language's light path expressions).

use std::fmt;

use regex_automata::{
    Anchored, Input,
    dfa::{Automaton, StartKind, dense},
    nfa::thompson,
    util::syntax,
};

use super::alphabet::{Letter, Letters, Tags};
use crate::text::one_line;

/// A light path expression as it was written: syntactically right, its names not yet looked up.
#[derive(Clone, Debug)]
pub struct Expression {
    text: String,
    root: Node,
}

/// What is wrong with an expression, and at which of its characters.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("character {at} of '{text}': {what}")]
pub struct ExpressionError {
    text: String,
    /// Counted from one.
    at: usize,
    what: String,
}

/// An expression that can be matched: an automaton that reads a path symbol by symbol.
#[derive(Clone, Debug)]
pub struct Matcher(dense::DFA<Vec<u32>>);

#[derive(Clone, Debug)]
enum Node {
    /// One symbol: any of `atoms`, or none of them.
    Symbol {
        atoms: Vec<Atom>,
        negated: bool,
    },
    Sequence(Vec<Self>),
    Either(Vec<Self>),
    Repeat {
        node: Box<Self>,
        least: u32,
        most: Option<u32>,
    },
}

/// Letters of these kinds, at a material of this name if one is given.
#[derive(Clone, Debug)]
struct Atom {
    kinds: Letters,
    name: Option<String>,
}

/// Groups within groups: more are a mistake or an attack.
const DEEPEST: u32 = 50;
/// Vertices of the longest path.
const MOST: u32 = 256;
/// Of an automaton, in bytes: a hundred times what sensible expressions need.
const LARGEST: usize = 1 << 18;
/// Bytes of the automaton before it is made deterministic, which takes time with the square of its states.
const LARGEST_BEFORE: usize = 1 << 16;

impl Expression {
    /// Reads an expression.
    ///
    /// `C` is the camera, `D`, `G` and `S` are diffuse, glossy and specular scattering, `L` is a light, `R` and `T` are
    /// any reflection and transmission, `.` is anything. `<TS>` is what is both, `<S'glass'>` what happens at a
    /// material of that name, `<L sun>` a light of that kind (surface, point, spot, sun, sky). `[DG]` is one of
    /// several, `[^S]` none of them; `*`, `+`, `?`, `{n}`, `{n,}`, `{n,m}`, `|` and parentheses are those of regular
    /// expressions. The whole path has to match, from the camera on.
    ///
    /// # Errors
    /// If it is not of this form.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        let mut parser = Parser { text, characters: text.chars().collect(), at: 0, depth: 0 };
        let root = parser.either()?;
        match parser.peek() {
            None => Ok(Self { text: text.to_owned(), root }),
            Some(')') => Err(parser.error("there is no '(' for this ')'")),
            Some(odd) => Err(parser.error(format!("'{odd}' cannot be here"))),
        }
    }

    /// The names of materials in it.
    pub fn names(&self) -> Vec<&str> {
        fn gather<'a>(node: &'a Node, names: &mut Vec<&'a str>) {
            match node {
                Node::Symbol { atoms, .. } => names.extend(atoms.iter().filter_map(|atom| atom.name.as_deref())),
                Node::Sequence(nodes) | Node::Either(nodes) => nodes.iter().for_each(|node| gather(node, names)),
                Node::Repeat { node, .. } => gather(node, names),
            }
        }
        let mut names = Vec::new();
        gather(&self.root, &mut names);
        names
    }

    /// The automaton for it, where `tags` knows its names.
    ///
    /// # Errors
    /// If the expression is so long that the automaton would be huge.
    pub fn compile(&self, tags: &Tags) -> Result<Matcher, ExpressionError> {
        let mut pattern = String::new();
        write(&self.root, tags, &mut pattern);
        dense::Builder::new()
            .configure(
                dense::Config::new()
                    .accelerate(false)
                    .start_kind(StartKind::Anchored)
                    .dfa_size_limit(Some(LARGEST))
                    .determinize_size_limit(Some(LARGEST)),
            )
            .thompson(thompson::Config::new().nfa_size_limit(Some(LARGEST_BEFORE)))
            .syntax(syntax::Config::new().unicode(false).utf8(false).dot_matches_new_line(true))
            .build(&format!("(?:{pattern})\\z"))
            .map(Matcher)
            .map_err(|_| ExpressionError {
                text: one_line(&self.text),
                at: 1,
                what: "the expression has too many parts; make it shorter".to_owned(),
            })
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Matcher {
    /// Whether a path with these symbols, camera first, matches as a whole.
    #[inline]
    pub fn matches(&self, symbols: &[u8]) -> bool {
        // An automaton without quit bytes cannot fail.
        matches!(self.0.try_search_fwd(&Input::new(symbols).anchored(Anchored::Yes)), Ok(Some(_)))
    }
}

/// Translates to the syntax of regular expressions over bytes.
fn write(node: &Node, tags: &Tags, pattern: &mut String) {
    match node {
        Node::Symbol { atoms, negated } => {
            let is_meant = |symbol: u8| atoms.iter().any(|atom| tags.is(symbol, atom.kinds, atom.name.as_deref()));
            pattern.push('[');
            let meant: Vec<u8> = tags.symbols().filter(|symbol| is_meant(*symbol) != *negated).collect();
            if meant.is_empty() {
                pattern.push_str(r"^\x00-\xff");
            }
            meant.iter().for_each(|symbol| pattern.push_str(&format!(r"\x{symbol:02x}")));
            pattern.push(']');
        }
        Node::Sequence(nodes) => nodes.iter().for_each(|node| write(node, tags, pattern)),
        Node::Either(nodes) => {
            for (i, node) in nodes.iter().enumerate() {
                pattern.push_str(if i == 0 { "(?:" } else { "|" });
                write(node, tags, pattern);
            }
            pattern.push(')');
        }
        Node::Repeat { node, least, most } => {
            pattern.push_str("(?:");
            write(node, tags, pattern);
            let most = most.map(|most| most.to_string()).unwrap_or_default();
            pattern.push_str(&format!("){{{least},{most}}}"));
        }
    }
}

/// A reader by recursive descent.
struct Parser<'a> {
    text: &'a str,
    characters: Vec<char>,
    at: usize,
    depth: u32,
}

impl Parser<'_> {
    fn error(&self, what: impl Into<String>) -> ExpressionError {
        ExpressionError { text: one_line(self.text), at: self.at + 1, what: one_line(&what.into()) }
    }

    fn peek(&mut self) -> Option<char> {
        while self.characters.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
        self.characters.get(self.at).copied()
    }

    fn takes(&mut self, wanted: char) -> bool {
        let is_next = self.peek() == Some(wanted);
        self.at += usize::from(is_next);
        is_next
    }

    fn either(&mut self) -> Result<Node, ExpressionError> {
        let mut branches = vec![self.sequence()?];
        while self.takes('|') {
            branches.push(self.sequence()?);
        }
        Ok(if branches.len() == 1 { branches.remove(0) } else { Node::Either(branches) })
    }

    fn sequence(&mut self) -> Result<Node, ExpressionError> {
        let mut nodes = Vec::new();
        while let Some(next) = self.peek()
            && !matches!(next, '|' | ')')
        {
            let node = self.one()?;
            nodes.push(self.repeated(node)?);
        }
        if nodes.is_empty() {
            return Err(self.error("an event is missing here, such as C, D, G, S, L or '.'"));
        }
        Ok(Node::Sequence(nodes))
    }

    fn one(&mut self) -> Result<Node, ExpressionError> {
        if self.takes('(') {
            if self.depth == DEEPEST {
                return Err(self.error(format!("groups are {DEEPEST} deep at most")));
            }
            self.depth += 1;
            let node = self.either()?;
            self.depth -= 1;
            return if self.takes(')') { Ok(node) } else { Err(self.error("a ')' is missing")) };
        }
        if self.takes('[') {
            let negated = self.takes('^');
            let mut atoms = Vec::new();
            while !self.takes(']') {
                match self.peek() {
                    None => return Err(self.error("a ']' is missing")),
                    Some(_) => atoms.push(self.atom()?),
                }
            }
            return if atoms.is_empty() {
                Err(self.error("the brackets are empty"))
            } else {
                Ok(Node::Symbol { atoms, negated })
            };
        }
        Ok(Node::Symbol { atoms: vec![self.atom()?], negated: false })
    }

    fn repeated(&mut self, node: Node) -> Result<Node, ExpressionError> {
        let (least, most) = match self.peek() {
            Some('*') => (0, None),
            Some('+') => (1, None),
            Some('?') => (0, Some(1)),
            Some('{') => return self.counted(node),
            _ => return Ok(node),
        };
        self.at += 1;
        if matches!(self.peek(), Some('*' | '+' | '?' | '{')) {
            return Err(self.error("this is repeated already"));
        }
        Ok(Node::Repeat { node: Box::new(node), least, most })
    }

    fn counted(&mut self, node: Node) -> Result<Node, ExpressionError> {
        self.at += 1;
        let Some(least) = self.number()? else { return Err(self.error("a number is missing here")) };
        let most = if self.takes(',') { self.number()? } else { Some(least) };
        if !self.takes('}') {
            return Err(self.error("a '}' is missing"));
        }
        if most.is_some_and(|most| most < least) {
            return Err(self.error("the second number is smaller than the first"));
        }
        if matches!(self.peek(), Some('*' | '+' | '?' | '{')) {
            return Err(self.error("this is repeated already"));
        }
        Ok(Node::Repeat { node: Box::new(node), least, most })
    }

    fn number(&mut self) -> Result<Option<u32>, ExpressionError> {
        let mut number = None;
        while let Some(digit) = self.peek().and_then(|c| c.to_digit(10)) {
            let value = number.unwrap_or(0) * 10 + digit;
            if value > MOST {
                return Err(self.error(format!("no path has more than {MOST} vertices")));
            }
            number = Some(value);
            self.at += 1;
        }
        Ok(number)
    }

    fn atom(&mut self) -> Result<Atom, ExpressionError> {
        if !self.takes('<') {
            let kinds = self.letter()?;
            return Ok(Atom { kinds, name: None });
        }
        let (mut kinds, mut name) = (Letters::ALL, None);
        loop {
            match self.peek() {
                None => return Err(self.error("a '>' is missing")),
                Some('>') => {
                    self.at += 1;
                    return Ok(Atom { kinds, name });
                }
                Some('\'') => name = Some(self.quoted()?),
                Some(c) if c.is_ascii_lowercase() => kinds = kinds & self.word()?,
                Some(_) => kinds = kinds & self.letter()?,
            }
        }
    }

    fn letter(&mut self) -> Result<Letters, ExpressionError> {
        let Some(letter) = self.peek() else { return Err(self.error("the expression ends too early")) };
        let kinds = Letters::of_letter(letter)
            .ok_or_else(|| self.error(format!("'{letter}' is no event; these are C, D, G, S, L, R, T and '.'")))?;
        self.at += 1;
        Ok(kinds)
    }

    fn word(&mut self) -> Result<Letters, ExpressionError> {
        let start = self.at;
        let rest = self.characters[start..].iter();
        let word: String = rest.take_while(|c| c.is_ascii_lowercase()).collect();
        let letter = Letter::LIGHTS.into_iter().find(|(_, name)| *name == word);
        let Some((letter, _)) = letter else {
            let known = Letter::LIGHTS.map(|(_, name)| name).join(", ");
            return Err(self.error(format!("'{word}' is no kind of light; these are {known}")));
        };
        self.at = start + word.len();
        Ok(Letters::just(letter))
    }

    fn quoted(&mut self) -> Result<String, ExpressionError> {
        let rest = &self.characters[self.at + 1..];
        let Some(length) = rest.iter().position(|c| *c == '\'') else {
            return Err(self.error("the name has no closing quote"));
        };
        let name = rest[..length].iter().collect();
        self.at += length + 2;
        Ok(name)
    }
}

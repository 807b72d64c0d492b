//! XML as it is written: elements in lines, their depth as indent.

/// A document on its way.
pub struct Xml {
    out: String,
    open: Vec<String>,
}

impl Xml {
    /// One with its declaration.
    pub fn new() -> Self {
        Self { out: "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned(), open: Vec::new() }
    }

    /// Opens an element with attributes, given as `name="value"` with values that need no escape.
    pub fn open(&mut self, name: &str, attributes: &str) {
        self.indent();
        let space = if attributes.is_empty() { "" } else { " " };
        self.out += &format!("<{name}{space}{attributes}>\n");
        self.open.push(name.to_owned());
    }

    /// Closes the element that was opened last.
    pub fn close(&mut self) {
        if let Some(name) = self.open.pop() {
            self.indent();
            self.out += &format!("</{name}>\n");
        }
    }

    /// An element with text alone.
    pub fn leaf(&mut self, name: &str, text: &str) {
        self.leaf_with(name, "", text);
    }

    /// An element with text and attributes.
    pub fn leaf_with(&mut self, name: &str, attributes: &str, text: &str) {
        self.indent();
        let space = if attributes.is_empty() { "" } else { " " };
        self.out += &format!("<{name}{space}{attributes}>{}</{name}>\n", escaped(text));
    }

    /// An element without content.
    pub fn empty(&mut self, name: &str, attributes: &str) {
        self.indent();
        self.out += &format!("<{name} {attributes}/>\n");
    }

    /// The document, every element closed.
    pub fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.out
    }

    fn indent(&mut self) {
        self.out.extend(std::iter::repeat_n("  ", self.open.len()));
    }
}

/// Text for an element or an attribute; characters that XML 1.0 has no place for become question marks.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            c if c.is_control() && !matches!(c, '\t' | '\n') => out.push('?'),
            '\u{fffe}' | '\u{ffff}' => out.push('?'),
            c => out.push(c),
        }
    }
    out
}

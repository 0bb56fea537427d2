//! Paths in Rust source, found without a parser's help: enough of the grammar to know what a file imports.
//!
//! In: source text and the module it belongs to. Out: absolute paths with the lines they stand in.

/// A path that starts at the crate's root, or in the standard library.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Import {
    /// Line, from 1.
    pub line: usize,
    /// Segments after `crate`; with `std` in front for the standard library. `*` for a glob.
    pub path: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Token {
    line: usize,
    text: String,
}

/// All paths of `source` through `crate`, `super` or `std`; `module` is where the file's items live, as in
/// `["render", "draw"]`.
pub(crate) fn imports(source: &str, module: &[String]) -> Vec<Import> {
    let tokens = tokens(source);
    let mut found = Vec::new();
    // Names of the inline modules that are open, with the depth of braces outside of each.
    let mut inline: Vec<(String, usize)> = Vec::new();
    let mut depth = 0;
    let mut at = 0;
    while at < tokens.len() {
        let text = |i: usize| tokens.get(i).map_or("", |token| token.text.as_str());
        match text(at) {
            "{" => depth += 1,
            "}" => {
                depth = usize::saturating_sub(depth, 1);
                inline.pop_if(|(_, outside)| *outside == depth);
            }
            "mod" if text(at + 2) == "{" => inline.push((text(at + 1).to_owned(), depth)),
            "crate" | "super" | "std" if text(at + 1) == "::" && (at == 0 || text(at - 1) != "::") => {
                let here = module.iter().cloned().chain(inline.iter().map(|(name, _)| name.clone()));
                let mut paths = Vec::new();
                at = read_tree(&tokens, at, &[], &mut paths);
                let here: Vec<String> = here.collect();
                found.extend(paths.into_iter().map(|(line, path)| Import { line, path: absolute(&path, &here) }));
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    found
}

/// Reads a path, or a tree of them in braces, and returns where it ends.
fn read_tree(tokens: &[Token], mut at: usize, stem: &[String], paths: &mut Vec<(usize, Vec<String>)>) -> usize {
    let text = |i: usize| tokens.get(i).map_or("", |token| token.text.as_str());
    let line = tokens.get(at).map_or(0, |token| token.line);
    let mut path = stem.to_vec();
    loop {
        if text(at) == "{" {
            at += 1;
            while !matches!(text(at), "}" | "") {
                at = if text(at) == "," { at + 1 } else { read_tree(tokens, at, &path, paths) };
            }
            return at + 1;
        }
        if !is_name(text(at)) {
            // A path that ends in `::<T>`, or no path at all.
            paths.push((line, path));
            return at.max(1) + usize::from(text(at) != "<");
        }
        path.push(text(at).to_owned());
        at += 1;
        if text(at) != "::" {
            paths.push((line, path));
            // A new name in an import is none of our business.
            return if text(at) == "as" { at + 2 } else { at };
        }
        at += 1;
    }
}

fn is_name(text: &str) -> bool {
    text == "*" || text.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// Resolves a path that starts with `crate`, `super` or `std` in module `here`.
fn absolute(path: &[String], here: &[String]) -> Vec<String> {
    match path[0].as_str() {
        "super" => {
            let up = path.iter().take_while(|segment| *segment == "super").count();
            let base = &here[..here.len().saturating_sub(up)];
            base.iter().chain(&path[up..]).cloned().collect()
        }
        "crate" => path[1..].to_vec(),
        _ => path.to_vec(),
    }
}

/// Names, `::` and single other characters, without comments and literals.
fn tokens(source: &str) -> Vec<Token> {
    let chars: Vec<char> = source.chars().collect();
    let mut tokens = Vec::new();
    let (mut at, mut line) = (0, 1);
    while at < chars.len() {
        let end = token_end(&chars, at);
        let text: String = chars[at..end].iter().collect();
        let kept = text == "::" || is_name(&text) || (text.len() == 1 && !chars[at].is_whitespace());
        if kept {
            tokens.push(Token { line, text: text.clone() });
        }
        line += text.matches('\n').count();
        at = end;
    }
    tokens
}

/// Where the token, comment or literal that starts at `at` ends.
fn token_end(chars: &[char], at: usize) -> usize {
    let next = chars.get(at + 1).copied().unwrap_or(' ');
    let until = |from: usize, stop: &dyn Fn(usize) -> bool| (from..chars.len()).find(|&i| stop(i));
    match chars[at] {
        '/' if next == '/' => until(at, &|i| chars[i] == '\n').unwrap_or(chars.len()),
        '/' if next == '*' => block_comment_end(chars, at),
        '"' => string_end(chars, at),
        'r' if next == '"' || next == '#' => raw_string_end(chars, at).unwrap_or(at + 1),
        '\'' => char_end(chars, at),
        ':' if next == ':' => at + 2,
        c if c.is_alphanumeric() || c == '_' => {
            until(at, &|i| !chars[i].is_alphanumeric() && chars[i] != '_').unwrap_or(chars.len())
        }
        _ => at + 1,
    }
}

fn block_comment_end(chars: &[char], start: usize) -> usize {
    let (mut depth, mut at) = (0, start);
    while at < chars.len() {
        match (chars[at], chars.get(at + 1)) {
            ('/', Some('*')) => (depth, at) = (depth + 1, at + 2),
            ('*', Some('/')) => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            return at;
        }
    }
    at
}

fn string_end(chars: &[char], start: usize) -> usize {
    let mut at = start + 1;
    while at < chars.len() && chars[at] != '"' {
        at += if chars[at] == '\\' { 2 } else { 1 };
    }
    (at + 1).min(chars.len())
}

/// `None` where `r` starts a name and no raw string.
fn raw_string_end(chars: &[char], start: usize) -> Option<usize> {
    let hashes = chars[start + 1..].iter().take_while(|&&c| c == '#').count();
    let quote = start + 1 + hashes;
    if chars.get(quote) != Some(&'"') {
        return None;
    }
    let closes =
        |at: usize| chars[at] == '"' && chars[at + 1..].iter().take(hashes).filter(|&&c| c == '#').count() == hashes;
    let end = (quote + 1..chars.len()).find(|&at| closes(at)).map_or(chars.len(), |at| at + 1 + hashes);
    Some(end)
}

/// The end of a character, or of the mark of a lifetime.
fn char_end(chars: &[char], start: usize) -> usize {
    match (chars.get(start + 1), chars.get(start + 2)) {
        (Some('\\'), _) => {
            let end = (start + 3..chars.len()).find(|&at| chars[at] == '\'');
            end.map_or(chars.len(), |at| at + 1)
        }
        (Some(_), Some('\'')) => start + 3,
        _ => start + 1,
    }
}

//! Which files a source follows: a folder, and a file name with at most one `*`.

use std::fmt;
use std::path::{Path, PathBuf};

/// The files of one source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FilePattern {
    folder: PathBuf,
    prefix: String,
    /// What follows the `*`; `None` where the name has none.
    suffix: Option<String>,
}

impl FilePattern {
    /// Parses `incoming/*.csv`; a relative folder is taken from `base`.
    ///
    /// # Errors
    /// What to write instead.
    pub fn parse(text: &str, base: &Path) -> Result<Self, String> {
        let path = base.join(text);
        let name = path.file_name().and_then(|name| name.to_str());
        let (Some(name), Some(folder)) = (name, path.parent()) else {
            return Err("write the path of a file, such as \"incoming/*.csv\"".to_owned());
        };
        if text.ends_with('/') {
            return Err(format!(
                "write which files in the folder, such as \"{text}*.csv\""
            ));
        }
        if text.matches('*').count() > 1 || folder.to_string_lossy().contains('*') {
            return Err("write at most one *, in the file name".to_owned());
        }
        let (prefix, suffix) = match name.split_once('*') {
            Some((prefix, suffix)) => (prefix, Some(suffix.to_owned())),
            None => (name, None),
        };
        Ok(Self {
            folder: folder.to_owned(),
            prefix: prefix.to_owned(),
            suffix,
        })
    }

    /// The folder that the files stand in.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether a file of this name is one of them. A hidden file never is by way of `*`: writers
    /// that replace a file atomically use such names for the half-written one.
    pub fn matches(&self, name: &str) -> bool {
        match &self.suffix {
            None => name == self.prefix,
            Some(suffix) => {
                name.len() >= self.prefix.len() + suffix.len()
                    && name.starts_with(&self.prefix)
                    && name.ends_with(suffix.as_str())
                    && (!name.starts_with('.') || self.prefix.starts_with('.'))
            }
        }
    }
}

impl fmt::Display for FilePattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let star = if self.suffix.is_some() { "*" } else { "" };
        let suffix = self.suffix.as_deref().unwrap_or_default();
        let name = format!("{}{star}{suffix}", self.prefix);
        write!(f, "{}", self.folder.join(name).display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_star_stands_for_any_part_of_the_name() {
        let pattern = FilePattern::parse("in/toc-*.csv", Path::new("/site")).unwrap();
        assert_eq!(pattern.folder(), Path::new("/site/in"));
        assert!(pattern.matches("toc-5.csv") && pattern.matches("toc-.csv"));
        assert!(!pattern.matches("toc-5.csv.gz") && !pattern.matches("5.csv"));
        assert_eq!(pattern.to_string(), "/site/in/toc-*.csv");
        let all = FilePattern::parse("in/*.csv", Path::new("/site")).unwrap();
        assert!(!all.matches(".5.csv"), "half-written");
    }

    #[test]
    fn a_pattern_that_names_no_single_folder_is_refused() {
        for text in ["*/5.csv", "in/*a*.csv", "in/", "/"] {
            assert!(
                FilePattern::parse(text, Path::new("/site")).is_err(),
                "{text}"
            );
        }
    }
}

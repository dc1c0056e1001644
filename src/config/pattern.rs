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
        if [".xlsx", ".xls", ".xlsm", ".xlsb", ".ods"]
            .iter()
            .any(|end| text.ends_with(end))
        {
            return Err(
                "a workbook cannot be followed: have the sheet saved as \"CSV UTF-8\", and write that file's path"
                    .to_owned(),
            );
        }
        if text.matches('*').count() > 1 || folder.to_string_lossy().contains('*') {
            return Err("write at most one *, in the file name".to_owned());
        }
        // Where the config and the path are bare names, the folder is the one that we stand in.
        let folder = if folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            folder
        };
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

    /// Whether this is one of the files, however its path is written.
    pub fn is_of(&self, file: &Path) -> bool {
        let whole = |folder: &Path| folder.canonicalize().ok();
        let name = file.file_name().and_then(|name| name.to_str());
        let folder = file
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let is_here = || {
            let ours = whole(&self.folder);
            ours.is_some() && ours == whole(folder.unwrap_or(Path::new(".")))
        };
        name.is_some_and(|name| {
            self.matches(name)
                || name
                    .strip_suffix(".gz")
                    .is_some_and(|name| self.matches(name))
        }) && is_here()
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
    fn a_bare_file_name_is_a_file_of_the_folder_that_we_stand_in() {
        let pattern = FilePattern::parse("slope.csv", Path::new("")).unwrap();
        assert_eq!(pattern.folder(), Path::new("."));
        assert!(pattern.matches("slope.csv"));
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

//! `[[webhook]]`: an address that alerts are sent to.

use super::every_way::common;
use super::table::Section;
use super::{Destination, HookConfig, Secret, SharedDestination, address};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// `[[webhook]]`: an address that alerts are sent to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Webhook {
    /// What logs and receipts call it.
    pub name: String,
    /// Where to, by `http` or `https`.
    pub address: hyper::Uri,
    /// The certificate authorities that are trusted instead of the machine's own, PEM.
    pub ca_file: Option<PathBuf>,
    /// What is sent.
    pub format: WebhookFormat,
    /// The file with the secret that signs what is sent; never absent of our own format.
    pub secret_file: Option<PathBuf>,
}

/// What a webhook sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WebhookFormat {
    /// The JSON that hooks get.
    Slipwatch,
    /// What Prometheus Alertmanager takes at `/api/v2/alerts`.
    Alertmanager,
}

impl WebhookFormat {
    /// By the word in the config.
    fn parse(word: &str) -> Result<Self, String> {
        match word {
            "slipwatch" => Ok(Self::Slipwatch),
            "alertmanager" => Ok(Self::Alertmanager),
            _ => Err("write \"slipwatch\" or \"alertmanager\"".to_owned()),
        }
    }
}

impl Destination for Webhook {
    fn table(&self) -> &'static str {
        "webhook"
    }

    fn name(&self) -> String {
        self.name.clone()
    }

    fn goes_by_keys(&self) -> bool {
        self.format == WebhookFormat::Alertmanager
    }

    fn forgets(&self) -> bool {
        self.format == WebhookFormat::Alertmanager
    }

    fn reads(&self) -> Vec<PathBuf> {
        let files = [&self.secret_file, &self.ca_file];
        files.into_iter().flatten().cloned().collect()
    }

    fn lacks(&self) -> Option<String> {
        let secret = self.secret_file.as_deref();
        let secret = secret.and_then(|file| Secret::read(file).err());
        let secret = secret.map(|error| error.to_string());
        secret.or_else(|| address::unreadable(self.ca_file.as_ref()?))
    }
}

/// Reads one; `taken` has what the ways out before it are called.
pub(super) fn read(
    mut section: Section<'_>,
    base: &Path,
    taken: &mut BTreeSet<String>,
) -> Option<HookConfig> {
    let example = "\"http://127.0.0.1:9000/alerts\"";
    let url = section.required("url", example);
    let address = url.as_ref().and_then(|url| address::of(&section, url));
    let name = section.text("name");
    let format = section.parsed("format", WebhookFormat::parse);
    let format = format.map_or(WebhookFormat::Slipwatch, |given| given.value);
    let secret = match format {
        WebhookFormat::Slipwatch => section.required("secret_file", "\"webhook.secret\""),
        // It checks no signature.
        WebhookFormat::Alertmanager => section.text("secret_file"),
    };
    let ca_file = address::ca_file(&mut section, address.as_ref());
    let common = common(&mut section);
    if common.extra.corrections && format == WebhookFormat::Alertmanager {
        section.error(
            section.at(),
            "webhook.corrections with format = \"alertmanager\": it has no message that corrects an alert".to_owned(),
            "leave corrections out, or add a [[webhook]] without format for them",
        );
    }
    if let Some(one) = name.as_ref().or(url.as_ref())
        && !taken.insert(one.value.clone())
    {
        section.error(
            &one.at,
            format!("there are two webhooks {:?}", one.value),
            "give each its own name: name = \"control room\"",
        );
    }
    section.finish();
    let (url, address) = (url?.value, address?);
    let webhook = Webhook {
        name: name.map_or(url, |given| given.value),
        address,
        ca_file: ca_file.map(|given| base.join(given)),
        format,
        secret_file: secret.map(|given| base.join(given.value)),
    };
    Some(common.to(SharedDestination::new(webhook), base))
}

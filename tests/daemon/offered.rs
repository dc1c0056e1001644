//! Hands alerts to hooks as a commit does.

use slipwatch::runtime::deliver::Dispatcher;
use slipwatch::runtime::hook::Alert;

/// To every hook that is to receive it.
pub(crate) fn offer(dispatcher: &Dispatcher, alert: &Alert) {
    dispatcher.supersede(alert);
    for share in dispatcher.shares(std::slice::from_ref(alert)) {
        dispatcher.offer_share(share.place, &share.alerts);
    }
}

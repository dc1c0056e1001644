//! The table of the ways out for alerts.

use super::cap::CAP;
use super::mqtt::MQTT_OUT;
use super::program::PROGRAM;
use super::way_out::WayOut;
use super::webhook::WEBHOOK;

/// All of them.
pub static WAYS_OUT: [&WayOut; 4] = [&PROGRAM, &WEBHOOK, &CAP, &MQTT_OUT];

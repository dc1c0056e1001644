// Elements, times and figures as a person reads them. Every text is set as text: a name is never markup.

const SVG = 'http://www.w3.org/2000/svg';
const EXPLAINED = { full: 'explains the residual in full', partly: 'explains a part of the residual', none: 'explains nothing' };
let zone = 'UTC';

/** An element with attributes and children; strings become text. */
export function el(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** The same in SVG. */
export function svg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, '');
    else if (value !== null && value !== undefined && value !== false) node.setAttribute(name, value);
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
}

/** Times are shown in this zone from here on. */
export function useZone(name) {
  try {
    new Intl.DateTimeFormat('en', { timeZone: name });
    zone = name;
  } catch {
    zone = 'UTC';
  }
  return zone;
}

function parts(date) {
  const format = new Intl.DateTimeFormat('en-CA', {
    timeZone: zone, hourCycle: 'h23', year: 'numeric', month: '2-digit', day: '2-digit', hour: '2-digit', minute: '2-digit',
  });
  return Object.fromEntries(format.formatToParts(date).map((part) => [part.type, part.value]));
}

/** 2012-05-14 06:30, in the site's zone. */
export function minute(time) {
  const p = parts(new Date(time));
  return `${p.year}-${p.month}-${p.day} ${p.hour}:${p.minute}`;
}

const WRITTEN = /^\s*(\d{4}-\d\d-\d\d)(?:[T ](\d\d:\d\d)(:\d\d(?:\.\d+)?)?)?\s*(Z|[+-]\d\d:\d\d)?\s*$/i;

/** The instant that is written: 2012-05-14 06:30 in the site's zone, or RFC 3339 with its offset; NaN where it is neither. */
export function instant(text) {
  const [, day, clock = '00:00', second = '', offset] = WRITTEN.exec(text) ?? [];
  const wanted = Date.parse(`${day}T${clock}${second}${offset ?? 'Z'}`);
  if (offset || !Number.isFinite(wanted)) return wanted;
  let guess = wanted;
  for (let round = 0; round < 3; round += 1) {
    guess += wanted - Date.parse(`${minute(guess).replace(' ', 'T')}${second}Z`);
  }
  return guess;
}

/** Where the axis of charts puts a time: as if the zone's local time were UTC. */
export function axisDate(seconds) {
  const p = parts(new Date(seconds * 1000));
  return new Date(Date.UTC(p.year, p.month - 1, p.day, p.hour, p.minute));
}

/** A time element that says the exact instant too. */
export function when(time) {
  // Before the first reading there is no data time.
  if (Date.parse(time) <= -9223372036000) return el('span', {}, 'before any reading');
  return el('time', { datetime: time, title: time }, minute(time));
}

/** A text, its times in UTC by the site's clocks. */
export function local(text) {
  return text.split(/(\d{4}-\d\d-\d\dT\d\d:\d\d(?::\d\d(?:\.\d+)?)?Z)/).map((part, index) => (index % 2 ? when(part) : part));
}

/** 3 d 4 h. */
export function span(seconds) {
  const steps = [[86400, 'd'], [3600, 'h'], [60, 'min']];
  for (const [index, [size, unit]] of steps.entries()) {
    if (seconds >= size) {
      const whole = Math.floor(seconds / size);
      const next = steps[index + 1];
      const rest = next ? Math.floor((seconds - whole * size) / next[0]) : 0;
      return rest > 0 && whole < 10 ? `${whole} ${unit} ${rest} ${next[1]}` : `${whole} ${unit}`;
    }
  }
  return `${Math.max(0, Math.floor(seconds))} s`;
}

/** Three figures. */
export function figure(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '-';
  const size = Math.abs(value);
  if (size >= 100) return value.toFixed(0);
  if (size === 0) return '0';
  return size < 0.001 ? value.toExponential(1) : String(Number(value.toPrecision(3)));
}

/** The chance by which red is called: within how many hours, and from which chance on. Older states only have that within the evacuation time. */
export function redChance(one) {
  const red = one.called?.red;
  if (!red) return [percent(one.chance_within_evacuation_time), 'within the evacuation time'];
  return [percent(red.chance), `within ${Math.round(red.within_hours)} h, red from ${percent(red.at_least)}`];
}

/** The chance by which orange and yellow are called. */
export function outlookChance(one) {
  const { orange, yellow } = one.called ?? {};
  if (!orange) return `${percent(one.chance_within_outlook)} within the outlook`;
  return `${percent(orange.chance)} within ${span(3600 * orange.within_hours)}, orange from ${percent(orange.at_least)}, yellow from ${percent(yellow.at_least)}`;
}

/** The chance that is reported, without what levels take off it; null in older states. */
export function expectedChance(one) {
  const chances = one.chances_of_collapse;
  return chances ? `best estimate: ${percent(chances.within_2_days)} within 2 days, ${percent(chances.within_30_days)} within 30 days` : null;
}

/** 5 %, < 1 %: no chance is shown as none, or as certain. */
export function percent(chance) {
  if (chance === null || chance === undefined) return '-';
  if (chance < 0.005) return '<\u00a01\u00a0%';
  if (chance > 0.995) return '>\u00a099\u00a0%';
  return `${Math.round(100 * chance)}\u00a0%`;
}

const SHAPES = {
  green: () => svg('circle', { cx: 8, cy: 8, r: 6 }),
  yellow: () => svg('path', { d: 'M8 1.5 15 14H1z' }),
  orange: () => svg('path', { d: 'M8 .8 15.2 8 8 15.2.8 8z' }),
  red: () => svg('path', { d: 'M5 1h6l4 4v6l-4 4H5l-4-4V5z' }),
  unknown: () => svg('rect', { x: 2.5, y: 2.5, width: 11, height: 11 }),
};

/** The shape of a level, for the page and the map. */
export function shape(level) {
  return SHAPES[level]();
}

/** A level by word, shape and colour. */
export function badge(level, size = '') {
  return el('span', { class: `level ${level} ${size}` }, svg('svg', { viewBox: '0 0 16 16', 'aria-hidden': 'true' }, shape(level)), level);
}

/** A benchmark's level, and beside it whether nothing can be said. */
export function badges(standing, size = '') {
  const own = isOutdated(standing) ? [] : [badge(standing.level, size)];
  return standing.is_unknown ? [...own, ' ', badge('unknown', size)] : own;
}

/** The level in words: a benchmark of which nothing can be said is never green. */
export function levelWords(standing) {
  if (!standing.is_unknown) return standing.level;
  return isOutdated(standing) ? 'unknown' : `${standing.level}, unknown`;
}

/** Whether the forecast is not of now: nothing can be said, and no level is in force. */
export function isOutdated(standing) {
  return standing.is_unknown && standing.level === 'green' && !standing.since;
}

/** When the slope is forecast to collapse, with the interval. */
export function collapse(forecast) {
  if (!forecast) return ['-', el('small', {}, 'no forecast yet')];
  const days = Math.round(forecast.horizon_days);
  const main = forecast.median ? [when(forecast.median)] : [`not within ${days} days`];
  const chance = `chance ${percent(forecast.probability)} within ${days} days`;
  const until = forecast.high ? `to ${minute(forecast.high)}` : 'or later';
  const main_is = forecast.median ? 'median, on the early side; ' : '';
  const text = forecast.low ? `${main_is}90 %: ${minute(forecast.low)} ${until}; ${chance}` : chance;
  return [...main, el('small', {}, text)];
}

/** Time that is left until the median forecast. */
export function left(forecast, now) {
  if (!forecast || !forecast.median) return null;
  const seconds = (Date.parse(forecast.median) - Date.parse(now)) / 1000;
  return seconds > 0 ? `in ${span(seconds)}` : `${span(-seconds)} ago`;
}

/** One event in a line. */
export function described(event) {
  switch (event.event) {
    case 'alert': return event.state === 'firing' ? event.text : `${event.level} ${event.state}: ${event.text}`;
    case 'together': return event.groups.map((group) => `${group.benchmarks.join(', ')} share a failure time: ${
      group.failure_time.median ? minute(group.failure_time.median) : `not within ${Math.round(group.failure_time.horizon_days)} days`}, chance of collapse ${
      percent(group.chance_within_evacuation_time)} within the evacuation time`).join('; ') || 'no benchmarks share a failure time any more';
    case 'order': return `${event.order}${event.by ? ` by ${event.by}` : ''}${event.until ? ` until ${minute(event.until)}` : ''}${event.why ? `: ${event.why}` : ''}`;
    case 'regime-flip': return `regime ${event.from} to ${event.to}, probability ${percent(event.probability)}`;
    case 'intercept-drift': return `inverse-velocity intercept moved to ${minute(event.to)}`;
    case 'transition-drift': return `transition time moved to ${minute(event.to)}`;
    case 'unexplained-residual': return event.surprise_nats === undefined
      ? `residual with structure since ${minute(event.since)}, like an undeclared load (s.d. ${figure(event.load_sd)} e-folds)`
      : `a reading nobody expected (surprise ${figure(event.surprise_nats)} nats)`;
    case 'effect-found': return `effect found: ${event.effect}${event.channel ? ` by ${event.channel}` : ''}, ${EXPLAINED[event.explained] ?? event.explained}${event.adopted ? '; forecasts use it from here on' : ''}`;
    case 'effect-dropped': return `effect dropped: ${event.effect}${event.channel ? ` by ${event.channel}` : ''}`;
    default: return event.text ? `${event.event}: ${event.text}` : event.event;
  }
}

/** Why the level is in force: the words of its alert; null where there is none. */
export function reason(standing, alerts) {
  const called = alerts.find((one) => one.benchmark === standing.benchmark && one.level === standing.level && one.state === 'firing');
  return called ? local(called.text) : null;
}

/** A list of events. */
export function list(events, none, own = null) {
  if (events.length === 0) return el('p', { class: 'soft' }, none);
  return el('ul', { class: 'log', tabindex: '0' }, events.map((event) => el('li', {},
    when(event.time), ' ',
    event.benchmark === own && own !== null ? null : event.benchmark ? el('a', { href: place(event.benchmark) }, event.benchmark) : el('span', {}, 'site'),
    ' ', event.event === 'alert' && event.state === 'firing' ? badge(event.level) : null, ' ', ...local(described(event)))));
}

let moment = null;

/** Links keep the moment that is shown. */
export function keepMoment(at) {
  moment = at;
}

/** The address of a benchmark's page, or of the site's. */
export function place(benchmark) {
  const at = moment ? `?at=${encodeURIComponent(moment)}` : '';
  return benchmark === null ? `#/${at}` : `#/b/${encodeURIComponent(benchmark)}${at}`;
}

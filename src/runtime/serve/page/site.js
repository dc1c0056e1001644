// The site: every benchmark by level, where each stands, what is in force.

import { get } from '/page/ask.js';
import { badge, badges, collapse, el, figure, isOutdated, left, list, local, outlookChance, place, redChance, shape, span, svg, described, when } from '/page/words.js';

const RANK = { green: 0, unknown: 0.5, yellow: 1, orange: 2, red: 3 };
const HEALTH = [
  [(h) => !h.is_caught_up, 'The daemon is still reading the past.'],
  [(h) => !h.is_store_writable, 'The state folder cannot be written to.'],
  [(h) => h.is_paused && h.is_store_writable, 'Nothing more is taken in: what came waits for room on the disk, or for the clock.'],
  [(h) => h.is_store_damaged, 'The state is damaged: restore a backup.'],
  [(h) => h.is_clock_wrong, 'The host\u2019s clock and the readings disagree: it is wrong, or the host was suspended.'],
  [(h) => h.config_refused, 'The config file was not taken at its reload: the one before stays in force. slipwatch check says why.'],
];

export class SitePage {
  constructor(view, orders) {
    this.name = null;
    this.view = view;
    this.orders = orders;
  }

  async ask(at, signal) {
    const [site, status] = await Promise.all([get('/api/site', { at }, signal), get('/api/status', {}, signal)]);
    return { site, status, frame: { ...site, version: status.version } };
  }

  close() {}

  draw({ site, status }, at) {
    const sorted = [...site.benchmarks].sort((a, b) => rank(b) - rank(a)
      || (b.chance_within_evacuation_time ?? 0) - (a.chance_within_evacuation_time ?? 0)
      || a.benchmark.localeCompare(b.benchmark, 'en', { numeric: true }));
    // What people are asked to do stands first: a telephone shows no more.
    const force = el('section', { class: 'card' }, el('h2', {}, 'In force'), this.force(site, at));
    const isFirst = site.alerts.some((one) => one.benchmark);
    const scrolled = this.view.querySelector('ul.log')?.scrollTop ?? 0;
    this.view.replaceChildren(
      this.head(site),
      ...(at ? [] : HEALTH.filter(([is]) => is(status)).map(([, text]) => el('p', { class: 'card level red' }, text))),
      ...(at ? [] : status.faults.map((one) => el('p', { class: 'card level red' }, one.source ? `Source ${one.source}: ` : '', one.text, ', since ', when(one.since)))),
      isFirst ? force : '',
      el('section', { class: 'card', 'aria-label': 'Benchmarks' }, table(sorted, site)),
      el('div', { class: !isFirst && sorted.some((one) => one.position) ? 'two' : '' },
        sketch(sorted, site.positions_are), isFirst ? null : force),
      ...(at || !status.drill ? [] : [drills(status.drill)]),
      el('section', { class: 'card' }, el('h2', {}, 'Newest events'), list(site.log, 'Nothing yet.')));
    const log = this.view.querySelector('ul.log');
    if (log) log.scrollTop = scrolled;
  }

  head(site) {
    const count = (level) => site.benchmarks.filter((one) => one.level === level && !(level === 'green' && one.is_unknown)).length;
    const unknown = site.benchmarks.filter((one) => one.is_unknown).length;
    const counts = ['red', 'orange', 'yellow', 'green'].map((level) => [count(level), level]);
    counts.push([unknown, 'unknown']);
    const text = counts.filter(([n]) => n > 0).map(([n, level]) => `${n} ${level}`).join(', ');
    return el('div', { class: 'head' }, el('h1', {}, site.site), site.level === 'green' && site.unknown_since ? null : badge(site.level, 'big'),
      site.unknown_since ? [badge('unknown', 'big'), el('span', {}, 'unknown since ', when(site.unknown_since))] : null,
      el('span', { class: 'soft' }, `${site.benchmarks.length} benchmark${site.benchmarks.length === 1 ? '' : 's'}: ${text || 'none yet'}`));
  }

  force(site, at) {
    // The gravest first: the list is as high as a screen at most.
    const alerts = site.alerts.filter((alert) => alert.benchmark).sort((a, b) => RANK[b.level] - RANK[a.level]);
    const items = alerts.map((alert) => {
      const seen = site.acknowledged_by[alert.key];
      const standing = site.benchmarks.find((one) => one.benchmark === alert.benchmark);
      const own = standing && standing.level === alert.level ? standing : null;
      const advised = own || (alert.level === 'unknown' && standing?.level === 'green');
      return el('li', {}, badge(alert.level), ' ', el('a', { href: place(alert.benchmark) }, alert.benchmark), ' since ', when(own?.since ?? alert.time),
        advised ? el('div', {}, el('strong', {}, standing.recommended)) : null,
        el('div', {}, 'When it was called: ', ...local(alert.text)),
        seen ? el('div', { class: 'soft' }, `seen by ${seen.by ?? 'somebody'} at `, when(seen.given_at ?? seen.time)) : null);
    });
    const quiet = site.silences.map((one) => el('li', {}, `${one.benchmark ?? 'the whole site'}: ${described(one)}`));
    const nodes = [items.length ? el('ul', { class: 'log', tabindex: '0' }, items) : el('p', { class: 'soft' }, 'No alert is in force.')];
    if (quiet.length) nodes.push(el('h2', {}, 'Not notified'), el('ul', { class: 'log' }, quiet));
    if (at === null) nodes.push(buttons(site, (kind) => this.orders(kind, null), ['acknowledge', 'silence', 'unsilence']));
    return nodes;
  }
}

/** How drills stand, where they are held. */
function drills(drill) {
  const passed = drill.passed_at ? [
    `The last that passed: ${figure(drill.latency_seconds)} s from the readings to the hook`,
    drill.acknowledged_seconds === null ? '' : `, acknowledged ${span(drill.acknowledged_seconds)} later`,
    ', ended ', when(drill.passed_at), '.'] : 'None has passed yet.';
  const alarms = [
    [drill.failure, ['The newest drill failed: ', drill.failure, '.']],
    [new Date(drill.overdue_after) < new Date(), ['One should have passed by ', when(drill.overdue_after), '.']]];
  return el('section', { class: 'card', 'aria-label': 'Drills' }, el('h2', {}, 'Drills'),
    alarms.filter(([is]) => is).map(([, text]) => el('p', {}, el('strong', {}, text))), el('p', {}, passed),
    el('p', { class: 'soft' }, `${drill.passed} passed and ${drill.failed} failed since `, when(drill.since), '. In a drill a made-up failure goes from a file to the hooks.'));
}

/** The buttons for orders, or why there are none. */
export function buttons(site, give, kinds) {
  if (!site.takes_orders) {
    return el('p', { class: 'soft' }, 'Orders are taken here where site.token_file is set; else by ', el('code', {}, 'slipwatch alerts'), '.');
  }
  const name = (kind) => kind[0].toUpperCase() + kind.slice(1);
  return el('p', { class: 'actions' }, kinds.map((kind) => el('button', { type: 'button', 'data-order': kind, onclick: () => give(kind) }, name(kind))));
}

function rank(standing) {
  return Math.max(RANK[standing.level], standing.is_unknown ? RANK.unknown : 0);
}

function table(standings, site) {
  if (standings.length === 0) return el('p', {}, 'No benchmark has given a reading yet.');
  const names = ['Level', 'Benchmark', 'Newest reading', 'Velocity', 'Collapse forecast', 'Chance of collapse', 'Regime'];
  const row = (one) => {
    const cells = [
      [badges(one), one.since ? el('small', {}, 'since ', when(one.since)) : null],
      [el('a', { class: 'id', href: place(one.benchmark) }, one.benchmark)],
      one.newest_reading ? [when(one.newest_reading), el('small', {}, `${span(one.silent_seconds)} ago`)] : ['none yet'],
      [`${figure(one.velocity_mm_per_day)} mm/day`],
      ...(isOutdated(one) ? [['-', el('small', {}, 'nothing can be said now')], ['-'], ['-']] : [
        [...collapse(one.failure_time), one.failure_time ? el('small', {}, left(one.failure_time, site.at ?? site.now)) : null],
        [redChance(one)[0], el('small', {}, redChance(one)[1]), el('small', {}, outlookChance(one))],
        [one.regime ?? '-']]),
    ];
    return el('tr', { 'data-benchmark': one.benchmark, 'data-level': one.level }, cells.map((cell, index) => el('td', { 'data-name': names[index] }, cell)));
  };
  return el('table', { class: 'cards' },
    el('thead', {}, el('tr', {}, names.map((name) => el('th', { scope: 'col' }, name)))),
    el('tbody', {}, standings.map(row)));
}

/** The plan, and where heights are known a section along the direction in which the benchmarks lie. */
function sketch(standings, says) {
  const placed = standings.filter((one) => one.position);
  if (placed.length === 0) return null;
  const plan = placed.map((one) => [one.position[0], one.position[1]]);
  const nodes = [el('h2', {}, 'Plan, north up'), drawing(placed, plan, 'Plan of the benchmarks')];
  if (placed.length > 1 && placed.every((one) => one.position.length === 3)) {
    const along = direction(plan);
    const section = placed.map((one, index) => [plan[index][0] * along[0] + plan[index][1] * along[1], one.position[2]]);
    nodes.push(el('h2', {}, 'Section'), drawing(placed, section, 'Section of the benchmarks'));
  }
  if (says) nodes.push(el('p', { class: 'soft' }, says));
  return el('section', { class: 'card' }, nodes);
}

function direction(points) {
  const mean = [0, 1].map((axis) => points.reduce((sum, point) => sum + point[axis], 0) / points.length);
  let [xx, xy, yy] = [0, 0, 0];
  for (const [x, y] of points) {
    xx += (x - mean[0]) ** 2;
    xy += (x - mean[0]) * (y - mean[1]);
    yy += (y - mean[1]) ** 2;
  }
  const angle = 0.5 * Math.atan2(2 * xy, xx - yy);
  return [Math.cos(angle), Math.sin(angle)];
}

const WIDTH = 420;
const EDGE = 46;

function drawing(standings, points, name) {
  const [xs, ys] = [0, 1].map((axis) => points.map((point) => point[axis]));
  const [width, height] = [Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys)];
  const scale = Math.min((WIDTH - 2 * EDGE) / Math.max(width, 1e-9), 220 / Math.max(height, 1e-9), 1e6);
  const size = Math.max(height * scale, 30) + 2 * EDGE;
  const left0 = (WIDTH - width * scale) / 2;
  const at = ([x, y]) => [left0 + (x - Math.min(...xs)) * scale, size - EDGE - (y - Math.min(...ys)) * scale];
  const bar = nice((WIDTH / 4) / scale);
  return svg('svg', { class: 'sketch', viewBox: `0 0 ${WIDTH} ${size.toFixed(0)}`, role: 'group', 'aria-label': name },
    svg('path', { class: 'rule', d: `M12 ${size - 10}h${bar * scale}m0-4v8M12 ${size - 14}v8` }),
    svg('text', { x: 16 + bar * scale, y: size - 6 }, `${bar} m`),
    standings.map((one, index) => {
      const [x, y] = at(points[index]);
      const level = one.is_unknown && one.level === 'green' ? 'unknown' : one.level;
      const mark = shape(level);
      mark.setAttribute('class', 'mark');
      const words = `${one.benchmark}: ${one.level}${one.is_unknown ? ', unknown' : ''}`;
      return svg('a', { href: place(one.benchmark), 'aria-label': words },
        svg('g', { class: level, transform: `translate(${x - 9} ${y - 9}) scale(1.15)` }, mark),
        svg('text', { x, y: y - 13, 'text-anchor': x < WIDTH / 3 ? 'start' : x > (2 * WIDTH) / 3 ? 'end' : 'middle' }, one.benchmark));
    }));
}

function nice(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return [5, 2, 1].map((factor) => factor * power).find((one) => one <= length) ?? power;
}

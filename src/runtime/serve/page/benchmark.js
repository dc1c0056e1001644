// One benchmark: how it stands, and everything on one axis of time.

import { get } from '/page/ask.js';
import { AFTER, Charts } from '/page/charts.js';
import { buttons } from '/page/site.js';
import { badges, collapse, el, expectedChance, figure, isOutdated, left, levelWords, list, outlookChance, percent, place, reason, redChance, span, svg, described, when } from '/page/words.js';

const DAY = 86400;
const SPANS = [[null, 'Whole record'], [365 * DAY, '1 year'], [30 * DAY, '30 days'], [7 * DAY, '7 days'], [DAY, '1 day']];
/** A zoomed stretch is asked for again in more detail after this pause. */
const PAUSE_MS = 250;

export class BenchmarkPage {
  constructor(view, name, orders) {
    this.name = name;
    this.view = view;
    this.orders = orders;
    this.window = null;
    this.at = null;
  }

  async ask(at, signal) {
    if (at !== this.asked) this.follow(at);
    this.asked = at;
    const edges = this.window ? this.window.map((t) => new Date(1000 * t).toISOString()) : [null, null];
    const buckets = Math.max(200, Math.min(1000, Math.round(this.view.clientWidth / 2)));
    const answer = await get('/api/benchmark', { id: this.name, at, from: edges[0], to: edges[1], buckets }, signal);
    return { ...answer, frame: answer };
  }

  close() {
    clearTimeout(this.timer);
    this.charts?.close();
  }

  restyle() {
    this.charts?.restyle();
  }

  draw(view, at) {
    this.at = at;
    this.last = view;
    if (!this.charts) this.build();
    this.headNode.replaceChildren(...this.head(view));
    this.factsNode.replaceChildren(...facts(view));
    this.giveNode.replaceChildren(...(at === null ? [buttons(view, (kind) => this.orders(kind, this.name), ['acknowledge', 'shelve', 'silence', 'resolve', 'unsilence'])] : []));
    // Each in a frame of its own, as the charts are.
    this.charts.draw(view, [
      () => {
        this.effectsNode.replaceChildren(...effects(view));
        fillList(this.alertsNode, list(view.alerts, 'No alert so far.', this.name));
        fillList(this.marksNode, list([...view.marks].reverse(), 'Nothing found, declared or ordered so far.', this.name));
      },
      () => this.planeNode.replaceChildren(plane(view.forecasts, view.latest?.regime)),
    ]);
  }

  build() {
    [this.headNode, this.factsNode, this.giveNode, this.chartsNode, this.planeNode, this.effectsNode, this.alertsNode, this.marksNode] =
      Array.from({ length: 8 }, () => el('div'));
    this.headNode.className = 'head';
    const tools = el('div', { class: 'tools', role: 'toolbar', 'aria-label': 'Stretch of time' },
      SPANS.map(([length, text]) => el('button', { type: 'button', onclick: () => this.near(length) }, text)),
      el('button', { type: 'button', class: 'finger', 'aria-pressed': 'false', onclick: (event) => this.brush(event.currentTarget) }, 'Drag to zoom'),
      [['Earlier', -0.5, 1], ['Later', 0.5, 1], ['Zoom in', 0, 0.5], ['Zoom out', 0, 2]].map(([text, shift, factor]) =>
        el('button', { type: 'button', onclick: () => this.move(shift, factor) }, text)));
    this.view.replaceChildren(this.headNode,
      el('section', { class: 'card', 'aria-label': 'How it stands' }, this.factsNode, this.giveNode),
      el('section', { class: 'card', 'aria-label': 'Over time' }, tools, this.chartsNode,
        el('p', { class: 'soft' }, 'The upright line is the moment that is shown. ',
          el('span', { class: 'mouse' }, 'Drag across a chart to look closer; a double click shows the whole record.'),
          el('span', { class: 'finger' }, 'A finger that is drawn across a chart reads its values; with Drag to zoom it looks closer.'))),
      el('div', { class: 'two' },
        el('section', { class: 'card' }, el('h2', {}, 'Regime, with its trail'), this.planeNode),
        el('section', { class: 'card' }, el('h2', {}, 'What the law lacks here'), this.effectsNode)),
      el('div', { class: 'two' },
        el('section', { class: 'card' }, el('h2', {}, 'Alerts'), this.alertsNode),
        el('section', { class: 'card' }, el('h2', {}, 'Found, declared, ordered'), this.marksNode)));
    this.charts = new Charts(this.chartsNode, (range) => this.zoomed(range));
  }

  head(view) {
    const seen = view.acknowledged.filter((ack) => ack.benchmark === null || ack.benchmark === undefined || ack.benchmark === this.name).pop();
    const quiet = view.silences.filter((one) => !one.benchmark || one.benchmark === this.name);
    return [el('a', { href: place(null) }, 'All benchmarks'), el('h1', {}, this.name), ...badges(view.standing, 'big'),
      ...(seen && ['acknowledged', 'latched'].includes(view.standing.alarm_state) ? [el('span', { class: 'soft' }, `seen by ${seen.by ?? 'somebody'}`)] : []),
      ...quiet.map((one) => el('span', { class: 'soft' }, `not notified: ${described(one)}`))];
  }

  /** Keeps another moment within the stretch that the charts look at. */
  follow(at) {
    const moment = Date.parse(at ?? this.last?.last ?? this.last?.now);
    if (this.charts) this.window = this.charts.follow(moment / 1000);
  }

  /** So many seconds until the moment that is shown. */
  near(length) {
    const end = Date.parse(this.last.at ?? this.last.last ?? this.last.now) / 1000;
    this.charts.show(length === null ? null : [end - length, end + AFTER * length]);
  }

  /** Whether a finger zooms or reads. */
  brush(button) {
    this.charts.isBrush = !this.charts.isBrush;
    button.setAttribute('aria-pressed', String(this.charts.isBrush));
  }

  move(shift, factor) {
    const [from, to] = this.charts.range();
    const [middle, half] = [(from + to) / 2 + shift * (to - from), (factor * (to - from)) / 2];
    this.charts.show([middle - half, middle + half]);
  }

  zoomed(range) {
    this.window = range;
    clearTimeout(this.timer);
    this.timer = setTimeout(async () => {
      try {
        const answer = await this.ask(this.at);
        this.draw(answer, this.at);
      } catch {
        // The next refresh says so.
      }
    }, PAUSE_MS);
  }
}

function fillList(node, fresh) {
  const had = node.querySelector('ul.log')?.scrollTop ?? 0;
  node.replaceChildren(fresh);
  if (had) fresh.scrollTop = had;
}

function facts(view) {
  const { standing } = view;
  const reading = standing.newest_reading ? [when(standing.newest_reading), el('small', {}, `${span(standing.silent_seconds)} ago`)] : ['none yet'];
  const since = [[standing.since, 'since '], [standing.unknown_since, 'unknown since ']].filter(([time]) => time);
  const why = reason(standing, view.alerts);
  const asOf = isOutdated(standing) ? el('small', {}, 'nothing can be said now') : null;
  const rows = [
    ['Level', [levelWords(standing), ...since.map(([time, word]) => el('small', {}, word, when(time)))]],
    ['Newest reading', reading],
    ['Velocity', [`${figure(standing.velocity_mm_per_day)} mm/day`]],
    ['Collapse forecast', asOf ? ['-', asOf]
      : [...collapse(standing.failure_time), left(standing.failure_time, view.at ?? view.now) ? el('small', {}, left(standing.failure_time, view.at ?? view.now)) : null]],
    ['Chance of collapse', asOf ? ['-']
      : [redChance(standing)[0], el('small', {}, redChance(standing)[1]), el('small', {}, outlookChance(standing)), expectedChance(standing) && el('small', {}, expectedChance(standing))]],
    ['Alarm state', [standing.alarm_state]],
    ['Regime', [standing.regime ?? '-', view.latest ? el('small', {}, `unstable ${percent(view.latest.regime.probability_unstable)}, accelerating ${percent(view.latest.regime.probability_accelerating)}`) : null]],
  ];
  const nodes = [el('p', {}, el('strong', {}, standing.recommended), why && el('span', { class: 'soft' }, ' ', ...why)), el('dl', {}, rows.map(([name, value]) => el('div', {}, el('dt', {}, name), el('dd', {}, value.filter((part) => part !== null)))))];
  if (view.is_cut) nodes.push(el('p', { class: 'soft' }, 'Only the newest 200,000 readings are looked at.'));
  return nodes;
}

/** Decades between the middle of the regime plane and its rim; nearer to the middle the scale is linear. */
const PLANE_DECADES = 3;

/** The most probable law of each forecast: to the right it is unstable, in the upper half it accelerates. */
function plane(forecasts, newest) {
  const hasLaw = (one) => one?.r_per_day != null && one.kappa_per_day != null;
  const trail = forecasts.filter(hasLaw).slice(-120);
  const known = hasLaw(newest) ? [...trail, newest] : trail;
  if (known.length === 0) return svg('svg', { class: 'plane', viewBox: '0 0 340 40' }, svg('text', { x: 8, y: 24 }, 'No law was fitted yet.'));
  const rim = (of) => 10 ** Math.ceil(Math.log10(Math.max(...known.map((one) => Math.abs(of(one))), 1e-9)));
  const [right, top] = [rim((one) => one.kappa_per_day), rim((one) => one.r_per_day)];
  const place = (value, most) => Math.sign(value) * Math.log10(1 + ((10 ** PLANE_DECADES - 1) * Math.abs(value)) / most) / PLANE_DECADES;
  const x = (kappa) => 185 + 125 * place(kappa, right);
  const y = (r) => 145 - 125 * place(r, top);
  const at = (one) => [x(one.kappa_per_day), y(one.r_per_day), one.probability_unstable];
  const points = trail.map(at);
  const word = (left, at, text, anchor) => svg('text', { x: left, y: at, 'text-anchor': anchor }, text);
  const ticks = (most) => [-1, -0.01, 0, 0.01, 1].map((part) => part * most);
  const last = at(known[known.length - 1]);
  return svg('svg', { class: 'plane', viewBox: '0 0 340 330', role: 'img', 'aria-label': 'r and kappa of the most probable law of each forecast, with their trail' },
    svg('rect', { class: 'frame', x: 60, y: 20, width: 250, height: 250 }),
    svg('path', { class: 'frame', d: 'M185 20v250M60 145h250' }),
    [['stable,', 66, 'start'], ['unstable,', 304, 'end']].flatMap(([text, left, anchor]) => [
      word(left, 34, text, anchor), word(left, 47, 'accelerating', anchor), word(left, 252, text, anchor), word(left, 265, 'decelerating', anchor)]),
    ticks(right).map((kappa) => word(x(kappa), 284, figure(kappa), 'middle')),
    ticks(top).map((r) => word(55, y(r) + 4, figure(r), 'end')),
    word(185, 302, 'kappa, 1/day', 'middle'),
    svg('text', { x: 12, y: 145, 'text-anchor': 'middle', transform: 'rotate(-90 12 145)' }, 'r, 1/day'),
    word(185, 322, 'a fuller point: more probably unstable', 'middle'),
    points.length > 1 ? svg('polyline', { class: 'trail', points: points.map(([left, at]) => `${left.toFixed(1)},${at.toFixed(1)}`).join(' ') }) : null,
    points.map(([left, at, unstable]) => svg('circle', { class: 'past', cx: left.toFixed(1), cy: at.toFixed(1), r: 2.5, 'fill-opacity': (0.1 + 0.9 * unstable).toFixed(2) })),
    svg('circle', { class: 'here', cx: last[0].toFixed(1), cy: last[1].toFixed(1), r: 6, 'fill-opacity': (0.1 + 0.9 * last[2]).toFixed(2) }));
}

/** What was found, and the forecast with and without it. */
function effects(view) {
  const found = view.marks.filter((mark) => ['effect-found', 'effect-dropped'].includes(mark.event));
  const load = view.marks.filter((mark) => mark.event === 'unexplained-residual' && mark.load_sd !== undefined).pop();
  const nodes = [];
  if (load) nodes.push(el('p', {}, `${described(load)[0].toUpperCase()}${described(load).slice(1)}.`));
  if (found.length === 0) nodes.push(el('p', { class: 'soft' }, 'No effect was found: forecasts go by the law and by motion alone.'));
  for (const one of found) nodes.push(el('p', {}, when(one.time), ` ${described(one)}.`));
  const plain = view.latest?.plain;
  if (plain) {
    nodes.push(el('table', {}, el('thead', {}, el('tr', {}, ['', 'Critical velocity passed'].map((name) => el('th', { scope: 'col' }, name)))),
      el('tbody', {}, [['with the effect', view.latest.critical_velocity_time], ['without it', plain.failure_time]].map(([name, forecast]) =>
        el('tr', {}, el('th', { scope: 'row' }, name), el('td', {}, collapse(forecast)))))));
  }
  return nodes;
}

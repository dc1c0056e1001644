// Charts of one benchmark on one axis of time: uPlot draws them, zoom and cursor are shared.

import { axisDate, el, figure, minute, percent } from '/page/words.js';

/* global uPlot */
const LEVELS = ['green', 'yellow', 'orange', 'red', 'unknown'];
/** What lies ahead of the moment, as a share of what lies before. */
const AHEAD = 0.3;
/** What lies after the moment, as a share of what lies before it, in a stretch that was chosen. */
export const AFTER = 0.25;
/** What the words of the time axis take below each chart. */
const TIMES = 10;
const AXIS = 64;

const seconds = (time) => Date.parse(time) / 1000;

function colours() {
  const style = getComputedStyle(document.documentElement);
  const names = ['ink', 'soft', 'rule', 'accent', 'fill', 'second', 'third', 'card', ...LEVELS, ...LEVELS.map((level) => `${level}-wash`)];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** All charts of a benchmark. */
export class Charts {
  constructor(node, zoomed) {
    this.node = node;
    this.zoomed = zoomed;
    this.zoom = null;
    this.plots = new Map();
    this.waiting = [];
    this.isBrush = false;
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(node);
  }

  close() {
    this.observer.disconnect();
    this.clear();
  }

  clear() {
    for (const { plot } of this.plots.values()) plot.destroy();
    this.plots.clear();
    this.waiting = [];
    this.node.replaceChildren();
  }

  /** In other colours. */
  restyle() {
    if (!this.view) return;
    this.clear();
    this.draw(this.view, this.first);
  }

  /** All charts of a view, after what else is drawn with it. */
  draw(view, first = []) {
    this.view = view;
    this.first = first;
    this.moment = seconds(view.at ?? view.now);
    this.shades = colours();
    const wanted = charts(view);
    if ([...this.plots.keys()].some((key, index) => wanted[index]?.key !== key)) this.clear();
    this.queue([...first, ...wanted.map((one) => () => this.drawn(one))]);
  }

  /** Works through these in place of what still waits, one a frame: all charts at once would hold the page up. */
  queue(tasks) {
    const isAtWork = this.waiting.length > 0;
    this.waiting = tasks;
    if (!isAtWork) requestAnimationFrame(() => this.turn());
  }

  turn() {
    this.waiting.shift()?.();
    if (this.waiting.length > 0) requestAnimationFrame(() => this.turn());
  }

  drawn(one) {
    const had = this.plots.get(one.key);
    if (had) {
      had.chart = one;
      had.plot.setData(one.data, false);
      this.look(had.plot);
    } else {
      this.add(one);
    }
    // A refresh leaves the value that is being read.
    const entry = this.plots.get(one.key);
    const { idx } = entry.plot.cursor;
    this.caption(entry, idx < one.data[0].length ? idx : null);
  }

  /** The whole record with some room for forecasts. */
  home() {
    const { view } = this;
    const from = view.first ? seconds(view.first) : this.moment - 86400;
    const shown = view.at ? this.moment : seconds(view.last ?? view.now);
    const ends = [shown, view.collapse ? seconds(view.collapse) : shown];
    const end = Math.max(...ends);
    return [from, end + AHEAD * Math.max(end - from, 3600)];
  }

  range() {
    return this.zoom ?? this.home();
  }

  /** Shows a stretch of time; `null` is the whole. */
  show(range) {
    this.zoom = range && range[1] - range[0] > 60 ? range : null;
    this.scale();
    this.zoomed(this.zoom);
  }

  /** Moves a stretch that has too little before the moment, or not the moment; what it is then. */
  follow(moment) {
    if (this.zoom && Number.isFinite(moment)) {
      const [from, to] = this.zoom;
      const before = (to - from) / (1 + AFTER);
      if (moment < from + 0.1 * before || moment > to) this.zoom = [moment - before, moment + AFTER * before];
    }
    return this.zoom;
  }

  scale() {
    const charts = [...this.plots.values()].map(({ plot }) => () => this.look(plot));
    // What is still to be drawn will look there by itself.
    this.queue([...this.waiting, ...charts]);
  }

  look(plot) {
    const [min, max] = this.range();
    plot.setScale('x', { min, max });
  }

  resize() {
    const width = this.node.clientWidth;
    for (const { plot, chart } of this.plots.values()) {
      if (width > 0 && plot.width !== width) plot.setSize({ width, height: chart.height });
    }
  }

  add(chart) {
    const caption = el('figcaption');
    const figureNode = el('figure', { class: 'chart', 'data-chart': chart.key, 'aria-label': chart.title }, caption);
    this.node.append(figureNode);
    const entry = { chart, caption };
    this.plots.set(chart.key, entry);
    entry.plot = new uPlot(this.options(entry), chart.data, figureNode);
    touch(entry.plot, () => this.isBrush);
  }

  options(entry) {
    const { shades } = this;
    const { chart } = entry;
    const axis = { stroke: shades.soft, grid: { stroke: shades.rule, width: 1 }, ticks: { stroke: shades.rule, width: 1 }, font: '12px system-ui, sans-serif' };
    return {
      width: Math.max(this.node.clientWidth, 200),
      height: chart.height + TIMES,
      tzDate: axisDate,
      legend: { show: false },
      padding: [6, 24, 0, 0],
      cursor: {
        y: false, points: { size: 7 }, drag: { x: true, y: false, setScale: false }, sync: { key: 'time' },
        bind: { dblclick: () => () => { this.show(null); return null; } },
      },
      scales: { x: { time: true, range: () => this.range() }, y: { range: (plot, min, max) => entry.chart.range(min, max, this) } },
      axes: [
        { ...axis, size: 30, space: 90, values: (plot, ticks, index, space, step) => ticks.map((tick) => tickWord(tick, step)) },
        { ...axis, size: AXIS, show: true, splits: chart.splits, values: chart.values, grid: chart.hasGrid === false ? { show: false } : axis.grid },
      ],
      series: [{}, ...chart.series(shades)],
      hooks: {
        drawAxes: [(plot) => this.marks(plot)],
        draw: [(plot) => entry.chart.over?.(plot, this)],
        setCursor: [(plot) => this.caption(entry, plot.cursor.idx)],
        setSelect: [(plot) => {
          if (plot.select.width < 4) return;
          const range = [plot.posToVal(plot.select.left, 'x'), plot.posToVal(plot.select.left + plot.select.width, 'x')];
          plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          this.show(range);
        }],
      },
    };
  }

  /** Upright lines: the moment, the collapse, what was found or declared. */
  marks(plot) {
    const { ctx, bbox } = plot;
    const upright = (time, colour, dash, width = 1) => {
      const x = plot.valToPos(time, 'x', true);
      if (x < bbox.left || x > bbox.left + bbox.width) return;
      line(ctx, [[x, bbox.top], [x, bbox.top + bbox.height]], colour, dash, width);
    };
    for (const mark of this.view.marks) {
      if (['effect-found', 'effect-dropped', 'declared'].includes(mark.event)) upright(seconds(mark.time), this.shades.third, [3, 4]);
    }
    upright(this.moment, this.shades.second, [], 1.5);
    if (this.view.collapse) upright(seconds(this.view.collapse), this.shades.ink, [], 2);
  }

  caption({ chart, caption, plot }, index) {
    const keys = chart.keys(this.shades).map(([name, colour, dash, block]) => {
      const node = el('span', { class: 'key' }, name);
      node.style.setProperty('--k', colour);
      if (dash) node.style.setProperty('--dash', dash);
      if (block) node.style.setProperty('--b', block);
      return node;
    });
    const value = plot && index !== null && index !== undefined ? chart.value(index) : null;
    caption.replaceChildren(el('b', {}, chart.title), ...keys, el('span', { class: 'value' }, value ?? ''));
  }
}

/** A finger: dragged across a chart it reads values, or chooses a stretch. Up and down it scrolls the page. */
function touch(plot, isBrush) {
  const { over } = plot;
  let start = null;
  const at = (event) => {
    const box = over.getBoundingClientRect();
    return [Math.min(Math.max(event.clientX - box.left, 0), box.width), event.clientY - box.top];
  };
  const stretch = (to, isEnd) => plot.setSelect({ left: Math.min(start, to), top: 0, width: Math.abs(to - start), height: over.clientHeight }, isEnd);
  const moved = (event) => {
    if (start === null || event.pointerType === 'mouse') return;
    const [left, top] = at(event);
    plot.setCursor({ left, top }, true, true);
    if (isBrush()) stretch(left, false);
  };
  over.addEventListener('pointerdown', (event) => {
    if (event.pointerType === 'mouse' || !event.isPrimary) return;
    // Else the browser adds a mouse that does the same again.
    event.preventDefault();
    over.setPointerCapture(event.pointerId);
    [start] = at(event);
    moved(event);
  });
  over.addEventListener('pointermove', moved);
  over.addEventListener('pointerup', (event) => {
    if (start !== null && event.pointerType !== 'mouse' && isBrush()) stretch(at(event)[0], true);
    start = null;
  });
  over.addEventListener('pointercancel', () => {
    if (start !== null) plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    start = null;
  });
}

function line(ctx, points, colour, dash = [], width = 1.5) {
  ctx.save();
  ctx.beginPath();
  points.forEach(([x, y], index) => (index ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
  ctx.strokeStyle = colour;
  ctx.setLineDash(dash.map((part) => part * devicePixelRatio));
  ctx.lineWidth = width * devicePixelRatio;
  ctx.stroke();
  ctx.restore();
}

/** Draws within the chart's frame only. */
function clipped(plot, draw) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  draw(ctx, bbox);
  ctx.restore();
}

const around = (min, max) => {
  if (min === null || !Number.isFinite(min)) return [0, 1];
  const room = 0.06 * Math.max(max - min, Math.abs(max) * 1e-3, 1e-6);
  return [min - room, max + room];
};

function charts(view) {
  const list = [];
  const isDisplacement = view.quantity === 'displacement';
  if (isDisplacement) list.push(plain('displacement', 'Displacement, mm', view.readings, 'accent', 170));
  list.push(plain('velocity', 'Velocity, mm/day', view.velocities, 'accent', 150, isDisplacement ? 'mean of readings' : 'readings'));
  list.push(inverse(view), forecasts(view), chances(view), regimes(view));
  const load = view.marks.filter((mark) => mark.undeclared_load).pop();
  if (load) list.push(undeclared(load.undeclared_load));
  for (const one of view.covariates) {
    list.push(plain(`covariate ${one.name}`, `${one.name}${one.unit ? `, ${one.unit}` : ''}`, one, 'third', 110));
  }
  list.push(levels(view));
  return list;
}

function plain(key, title, columns, colour, height, name = 'readings') {
  return {
    key, title, height,
    data: [columns.t, columns.v],
    range: around,
    series: (shades) => [{ stroke: shades[colour], width: 1.5, points: { show: columns.t.length < 150, size: 4, fill: shades[colour] } }],
    keys: (shades) => [[name, shades[colour]]],
    value: (index) => `${minute(1000 * columns.t[index])}: ${figure(columns.v[index])}`,
  };
}

/** The load beyond the law as the newest search saw it, before and after the effects that it found. */
function undeclared(load) {
  const t = load.times.map(seconds);
  const after = load.after.length ? load.after : t.map(() => null);
  return {
    key: 'undeclared', title: 'Undeclared load, e-folds', height: 130,
    data: [t, load.before, after],
    range: (min, max) => around(Math.min(min ?? 0, 0), Math.max(max ?? 0, 0)),
    series: (shades) => [{ stroke: shades.soft, width: 1.5, dash: [6, 3], points: { show: false } }, { stroke: shades.accent, width: 1.8, points: { show: false } }],
    keys: (shades) => [['before what was found', shades.soft, 'dashed'], ['after', shades.accent, '', shades.fill]],
    value: (index) => `${minute(1000 * t[index])}: ${figure(load.before[index])}${load.after.length ? `, after ${figure(load.after[index])}` : ''}`,
    over: (plot, { shades }) => clipped(plot, (ctx) => {
      const at = (index, value) => [plot.valToPos(t[index], 'x', true), plot.valToPos(value, 'y', true)];
      const { min, max } = plot.scales.x;
      line(ctx, [min, max].map((edge) => [plot.valToPos(edge, 'x', true), plot.valToPos(0, 'y', true)]), shades.rule, [], 1);
      if (!load.after.length) return;
      // 90 % of a normal distribution.
      const edge = (sign) => load.after.map((mean, index) => at(index, mean + sign * 1.645 * load.after_sd[index]));
      ctx.beginPath();
      [...edge(1), ...edge(-1).reverse()].forEach(([x, y], index) => (index ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
      ctx.closePath();
      ctx.fillStyle = shades.fill;
      ctx.fill();
    }),
  };
}

function inverse(view) {
  const points = view.velocities.t.map((t, index) => [t, view.velocities.v[index]]).filter(([, v]) => v > 0).map(([t, v]) => [t, 1 / v]);
  const latest = view.latest;
  const fan = latest?.failure_time;
  // From the newest reading that it rests on, wherever the charts look.
  const from = latest?.velocity_mm_per_day > 0 ? [seconds(latest.t_max), 1 / latest.velocity_mm_per_day] : null;
  // The slow velocities of the beginning would press the end flat.
  const late = points.slice(Math.floor(points.length / 2)).map(([, y]) => y);
  const top = 1.25 * Math.max(...(late.length ? late : [1]), view.line ? Math.min(view.line[0][1], 2 * Math.max(...late, 1e-9)) : 0);
  return {
    key: 'inverse', title: 'Inverse velocity, day/mm', height: 190,
    data: [points.map(([t]) => t), points.map(([, y]) => y)],
    range: () => [0, top > 0 && Number.isFinite(top) ? top : 1],
    series: (shades) => [{ stroke: shades.ink, width: 0, paths: () => null, points: { show: true, size: 4, fill: shades.ink, width: 1 } }],
    keys: (shades) => [['1 / velocity', shades.ink], ['line through the newest', shades.accent, 'dashed'], ['forecast: median in 5 to 95 %', shades.second, '', shades.fill]],
    value: (index) => `${minute(1000 * points[index][0])}: ${figure(points[index][1])}`,
    over: (plot, { shades, moment }) => clipped(plot, (ctx) => {
      const at = (t, y) => [plot.valToPos(t, 'x', true), plot.valToPos(y, 'y', true)];
      const far = plot.scales.x.max + (plot.scales.x.max - plot.scales.x.min);
      if (fan?.low && from) {
        const high = fan.high ? seconds(fan.high) : far;
        const start = at(Math.min(from[0], moment), from[1]);
        ctx.beginPath();
        ctx.moveTo(...start);
        ctx.lineTo(...at(seconds(fan.low), 0));
        ctx.lineTo(...at(high, 0));
        ctx.closePath();
        ctx.fillStyle = shades.fill;
        ctx.fill();
        if (fan.median) line(ctx, [start, at(seconds(fan.median), 0)], shades.second);
      }
      if (view.line) line(ctx, view.line.map(([t, y]) => at(t, y)), shades.accent, [6, 4], 1.8);
    }),
  };
}

/** When each forecast said that the slope would collapse, against when it was made. */
function forecasts(view) {
  const made = view.forecasts.map((one) => seconds(one.time));
  const median = view.forecasts.map((one) => (one.failure_time.median ? seconds(one.failure_time.median) : null));
  return {
    key: 'forecast', title: 'Collapse forecast, against when it was made', height: 190,
    data: [made, median],
    range: (min, max, all) => {
      const [from, to] = all.range();
      return [from, to + 0.4 * (to - from)];
    },
    values: (plot, ticks) => ticks.map((t) => dateWord(t, plot.scales.y.max - plot.scales.y.min)),
    splits: (plot, axis, min, max) => dates(min, max, 4),
    series: (shades) => [{ stroke: shades.accent, width: 0, paths: () => null, points: { show: true, size: 5, fill: shades.accent } }],
    keys: (shades) => [['median', shades.accent], ['5 to 95 %', shades.accent, '', shades.fill], ['time of the forecast', shades.soft, 'dotted'], ...(view.collapse ? [['what happened', shades.ink]] : [])],
    value: (index) => {
      const { failure_time: failure } = view.forecasts[index];
      const word = (time) => (time ? minute(time) : 'later');
      return `made ${minute(view.forecasts[index].time)}: ${word(failure.median)} (${word(failure.low)} to ${word(failure.high)}), chance ${percent(failure.probability)}`;
    },
    over: (plot, { shades }) => clipped(plot, (ctx) => {
      const at = (t, y) => [plot.valToPos(t, 'x', true), plot.valToPos(y, 'y', true)];
      const { min, max } = plot.scales.x;
      line(ctx, [at(min, min), at(max, max)], shades.soft, [2, 4]);
      if (view.collapse) line(ctx, [at(min, seconds(view.collapse)), at(max, seconds(view.collapse))], shades.ink);
      const width = Math.max(2, Math.min(6, plot.bbox.width / Math.max(1, 2 * made.length)));
      for (const [index, { failure_time: failure }] of view.forecasts.entries()) {
        if (!failure.low) continue;
        const [x, low] = at(made[index], seconds(failure.low));
        const high = failure.high ? at(0, seconds(failure.high))[1] : plot.bbox.top - 1;
        ctx.fillStyle = shades.fill;
        ctx.fillRect(x - width / 2, high, width, low - high);
      }
    }),
  };
}

function dates(min, max, count) {
  const steps = [3600, 21600, 86400, 2 * 86400, 7 * 86400, 14 * 86400, 30 * 86400, 91 * 86400, 182 * 86400, 365 * 86400, 5 * 365 * 86400];
  const step = steps.find((one) => (max - min) / one <= count + 1) ?? (max - min) / count;
  const list = [];
  for (let t = Math.ceil(min / step) * step; t <= max; t += step) list.push(t);
  return list;
}

function tickWord(t, step) {
  const text = minute(1000 * t);
  if (step >= 300 * 86400) return text.slice(0, 4);
  if (step >= 28 * 86400) return text.slice(0, 7);
  return step >= 86400 ? text.slice(5, 10) : text.slice(5);
}

function dateWord(t, range) {
  const text = minute(1000 * t);
  if (range < 4 * 86400) return text.slice(5);
  return range > 300 * 86400 ? text.slice(0, 7) : text.slice(5, 10);
}

function two(key, title, view, [first, second], [one, other]) {
  const t = view.forecasts.map((forecast) => seconds(forecast.time));
  const data = [t, view.forecasts.map(first), view.forecasts.map(second)];
  return {
    key, title, height: 110, data,
    range: () => [0, 1.02],
    splits: () => [0, 0.5, 1],
    values: (plot, ticks) => ticks.map((tick) => `${100 * tick} %`),
    series: (shades) => [{ stroke: shades.red, width: 1.8, points: { show: false } }, { stroke: shades.accent, width: 1.5, dash: [6, 3], points: { show: false } }],
    keys: (shades) => [[one, shades.red], [other, shades.accent, 'dashed']],
    value: (index) => `${minute(1000 * t[index])}: ${percent(data[1][index])}, ${percent(data[2][index])}`,
  };
}

/** The chances by which levels are called, with the limits from which they are. */
function chances(view) {
  const limits = view.forecasts.findLast((one) => one.called)?.called;
  const chart = two('chance', 'Chance of collapse, by which levels are called', view,
    [(one) => one.called?.red.chance ?? one.chance_within_evacuation_time, (one) => one.called?.orange.chance ?? one.chance_within_outlook],
    [limits ? `within ${Math.round(limits.red.within_hours)} h; red from ${percent(limits.red.at_least)} (dotted)` : 'within the evacuation time',
      limits ? `within the outlook; orange from ${percent(limits.orange.at_least)} (dotted)` : 'within the outlook']);
  if (!limits) return chart;
  const { series } = chart;
  const limit = (stroke) => ({ stroke, width: 1, dash: [1, 4], points: { show: false } });
  chart.data.push(chart.data[0].map(() => limits.red.at_least), chart.data[0].map(() => limits.orange.at_least));
  chart.series = (shades) => [...series(shades), limit(shades.red), limit(shades.accent)];
  return chart;
}

const regimes = (view) => two('regime', 'Regime, probability', view,
  [(one) => one.probability_unstable, (one) => one.probability_accelerating], ['unstable', 'accelerating']);

/** The levels as a band with words, what was found or declared as letters above it. */
function levels(view) {
  const ends = view.levels.length ? [seconds(view.levels[0].from), seconds(view.levels[view.levels.length - 1].to)] : [];
  const known = new Set(view.marks.map((mark) => mark.event));
  return {
    key: 'levels', title: 'Levels', height: 62, hasGrid: false,
    data: [ends, ends.map(() => 0.5)],
    range: () => [0, 1],
    splits: () => [],
    series: () => [{ show: true, paths: () => null, points: { show: false } }],
    keys: () => Object.entries(view.letters).filter(([kind]) => known.has(kind)).map(([kind, letter]) => [`${letter}: ${kind}`, 'transparent']),
    value: () => null,
    over: (plot, { shades }) => clipped(plot, (ctx, bbox) => {
      const x = (time) => plot.valToPos(seconds(time), 'x', true);
      const [top, height] = [bbox.top + 0.42 * bbox.height, 0.58 * bbox.height];
      ctx.font = `600 ${12 * devicePixelRatio}px system-ui, sans-serif`;
      ctx.textBaseline = 'middle';
      ctx.textAlign = 'left';
      for (const one of [...view.levels, ...view.unknown]) {
        const [from, to] = [x(one.from), x(one.to)];
        const isBeside = one.level === 'unknown';
        const [y, h] = isBeside ? [top, height / 3] : [top, height];
        ctx.fillStyle = shades[`${one.level}-wash`];
        ctx.fillRect(from, y, to - from, h);
        ctx.strokeStyle = shades[one.level];
        ctx.lineWidth = devicePixelRatio;
        ctx.strokeRect(from, y, to - from, h);
        const seen = [Math.max(from, bbox.left), Math.min(to, bbox.left + bbox.width)];
        ctx.fillStyle = shades[one.level];
        if (!isBeside && seen[1] - seen[0] > ctx.measureText(one.level).width + 8) ctx.fillText(one.level, seen[0] + 4, top + height / 2);
      }
      ctx.fillStyle = shades.third;
      for (const mark of view.marks) ctx.fillText(view.letters[mark.event] ?? '', x(mark.time), bbox.top + 0.2 * bbox.height);
    }),
  };
}

// The page: which view, at which moment, live or not.

import { follow, forget, hasToken, order, Refused } from '/page/ask.js';
import { BenchmarkPage } from '/page/benchmark.js';
import { SitePage } from '/page/site.js';
import { el, instant, keepMoment, minute, useZone } from '/page/words.js';

const SOON_MS = 300;
const SELDOM_MS = 30000;
const byId = (id) => document.getElementById(id);
const state = { at: null, route: null, page: null, span: null, isLost: false, since: null, asked: null, cost: 0, seen: null };

/** #/?at=T or #/b/ID?at=T */
function readAddress() {
  const [path, query] = location.hash.replace(/^#/, '').split('?');
  const at = new URLSearchParams(query ?? '').get('at');
  const name = path.startsWith('/b/') ? decodeURIComponent(path.slice(3)) : null;
  return { at: at && Number.isFinite(Date.parse(at)) ? new Date(Date.parse(at)).toISOString() : null, name };
}

function writeAddress(at) {
  const path = location.hash.replace(/^#/, '').split('?')[0] || '/';
  history.replaceState(null, '', at ? `#${path}?at=${encodeURIComponent(at)}` : `#${path}`);
}

function go() {
  const { at, name } = readAddress();
  const had = state.page;
  state.at = at;
  keepMoment(at);
  if (!had || had.name !== name) {
    had?.close();
    const view = byId('view');
    view.replaceChildren(el('p', {}, 'Reading the state.'));
    state.page = name === null ? new SitePage(view, orders) : new BenchmarkPage(view, name, orders);
    if (had) view.focus();
  }
  refresh();
}

/** Shows another moment; `null` is now. */
function show(at) {
  writeAddress(at);
  state.at = at;
  keepMoment(at);
  refresh();
}

async function refresh() {
  state.asked?.abort();
  const asked = new AbortController();
  state.asked = asked;
  const page = state.page;
  const started = performance.now();
  try {
    const answer = await page.ask(state.at, asked.signal);
    if (asked.signal.aborted || page !== state.page) return;
    frame(answer.frame);
    const focus = focused();
    page.draw(answer, state.at);
    focus?.();
    state.cost = performance.now() - started;
    document.documentElement.dataset.shown = String(Date.now());
    if (!state.isLost) banner();
  } catch (error) {
    if (asked.signal.aborted) return;
    if (error instanceof Refused) warn(error.message);
    else lost();
  }
}

/** How to give the focus back after the view was drawn anew. */
function focused() {
  const node = document.activeElement;
  if (!node || !byId('view').contains(node) || node === byId('view')) return null;
  const alike = () => [...byId('view').querySelectorAll(node.tagName)].filter((one) => one.getAttribute('href') === node.getAttribute('href')
    && one.dataset.order === node.dataset.order && one.textContent === node.textContent);
  const index = alike().indexOf(node);
  return () => {
    if (!node.isConnected) alike()[Math.max(0, index)]?.focus({ preventScroll: true });
  };
}

/** What stands around every view: the name, the moment, the slider. */
function frame({ site, time_zone: zone, now, first, last, version, newest_event: seen }) {
  state.seen = seen;
  if (site) {
    byId('name').textContent = site;
    document.title = `${state.page.name === null ? '' : `${state.page.name}, `}${site}`;
    byId('zone').textContent = useZone(zone);
    byId('foot').textContent = `slipwatch ${version}. Times in ${useZone(zone)}. Every forecast is shown as it was made.`;
  }
  const end = Math.max(Date.parse(last ?? now), Date.parse(first ?? now));
  state.span = { from: Date.parse(first ?? now), to: end };
  const shown = state.at === null ? end : Date.parse(state.at);
  const slide = byId('slide');
  if (document.activeElement !== slide || state.at === null) {
    slide.value = String(1000 * (shown - state.span.from) / Math.max(1, state.span.to - state.span.from));
  }
  slide.setAttribute('aria-valuetext', state.at === null ? 'live' : minute(state.at));
  if (document.activeElement !== byId('date')) byId('date').value = minute(state.at ?? now);
  byId('live').setAttribute('aria-pressed', String(state.at === null));
  byId('leave').hidden = !hasToken();
  mark();
}

function mark() {
  const link = byId('link');
  link.className = state.isLost ? 'link lost' : state.at ? 'link past' : 'link';
  link.textContent = state.isLost ? 'no connection' : state.at ? 'the past' : 'live';
}

function banner() {
  const past = byId('banner');
  past.hidden = state.at === null;
  past.className = 'past';
  if (state.at) past.textContent = `As it was known at ${minute(state.at)}. Nothing that came later is shown.`;
}

function warn(text) {
  const line = byId('banner');
  line.hidden = false;
  line.className = '';
  line.textContent = text;
}

function lost() {
  if (!state.isLost) state.since = Date.now();
  state.isLost = true;
  mark();
  warn(`No connection to the daemon since ${minute(state.since)}. What is shown is old; the page tries again by itself.`);
}

function found() {
  const was = state.isLost;
  state.isLost = false;
  mark();
  if (was) {
    byId('banner').hidden = true;
    refresh();
  }
}

let timer = null;

/** Many changes make one refresh. */
function changed() {
  if (state.at !== null) return;
  timer ??= setTimeout(() => {
    timer = null;
    refresh();
  }, Math.max(SOON_MS, 4 * state.cost));
}

/** Lets a person give an order. */
function orders(kind, benchmark) {
  const means = {
    acknowledge: 'Somebody has seen the alerts in force: hooks that have not taken them are not tried again.',
    shelve: 'The level in force, and lower ones, are not sent until then. A higher one is, at once.',
    silence: 'Nobody is notified until then, not of red either. What is in force at the end is sent then.',
    resolve: 'The level in force ends, because people know why it was called and that it is over. The next reading that calls for it calls it again.',
    unsilence: 'What was shelved or silenced is sent again from now on.',
  };
  const spans = { shelve: [[3600, '1 h'], [28800, '8 h'], [86400, '1 day'], [604800, '7 days'], [2592000, '30 days']],
    silence: [[1800, '30 min'], [3600, '1 h'], [28800, '8 h'], [86400, '1 day'], [604800, '7 days']] }[kind];
  byId('order-title').textContent = `${kind[0].toUpperCase()}${kind.slice(1)}: ${benchmark ?? 'the whole site'}`;
  byId('order-means').textContent = means[kind];
  byId('order-wrong').textContent = '';
  byId('by').value = localStorage.getItem('slipwatch-by') ?? '';
  byId('why').value = '';
  byId('span-label').hidden = !spans;
  byId('span').replaceChildren(...(spans ?? []).map(([seconds, text]) => el('option', { value: seconds }, text)));
  // What is called while the dialog is open, or later, nobody has seen.
  const { seen } = state;
  byId('order').showModal();
  byId('order-give').onclick = async () => {
    const by = byId('by').value.trim();
    if (!by) {
      byId('order-wrong').textContent = 'A name is needed.';
      return;
    }
    if (kind === 'resolve' && !byId('why').value.trim()) {
      byId('order-wrong').textContent = 'A reason is needed.';
      return;
    }
    localStorage.setItem('slipwatch-by', by);
    try {
      const why = byId('why').value.trim() || null;
      await order({ order: kind, benchmark, by, why, seen, ...(spans ? { seconds: Number(byId('span').value) } : {}) });
      byId('order').close();
      changed();
    } catch (error) {
      byId('order-wrong').textContent = error instanceof Refused ? error.message : 'The daemon did not answer.';
    }
  };
}

function useTheme(name) {
  document.documentElement.dataset.theme = name;
  byId('theme').textContent = name === 'dark' ? 'Light' : 'Dark';
  state.page?.restyle?.();
}

const dark = matchMedia('(prefers-color-scheme: dark)');
useTheme(localStorage.getItem('slipwatch-theme') ?? (dark.matches ? 'dark' : 'light'));
dark.addEventListener('change', () => {
  if (!localStorage.getItem('slipwatch-theme')) useTheme(dark.matches ? 'dark' : 'light');
});
byId('theme').addEventListener('click', () => {
  const name = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
  localStorage.setItem('slipwatch-theme', name);
  useTheme(name);
});
byId('leave').addEventListener('click', () => {
  forget();
  location.reload();
});
byId('live').addEventListener('click', () => show(null));
byId('moment').addEventListener('submit', (event) => event.preventDefault());
byId('slide').addEventListener('input', () => {
  const share = Number(byId('slide').value) / 1000;
  if (state.span) show(share >= 1 ? null : new Date(state.span.from + share * (state.span.to - state.span.from)).toISOString());
});
byId('date').addEventListener('change', () => {
  const time = instant(byId('date').value);
  const isTime = Number.isFinite(time);
  byId('date').setCustomValidity(isTime ? '' : 'Write 2012-05-14 06:30, or 2012-05-14T04:30:00Z.');
  byId('date').reportValidity();
  if (isTime) show(new Date(time).toISOString());
});
addEventListener('hashchange', go);
setInterval(() => { if (state.at === null && !state.isLost) refresh(); }, SELDOM_MS);
go();
follow({ changed, lost, found });

// Asks the daemon, with the token where it wants one, and follows its changes.

const KEY = 'slipwatch-token';
let token = sessionStorage.getItem(KEY) ?? localStorage.getItem(KEY);
let entering = null;

export class Refused extends Error {}

/** Whether a token is in use. */
export function hasToken() {
  return token !== null;
}

/** Forgets it. */
export function forget() {
  sessionStorage.removeItem(KEY);
  localStorage.removeItem(KEY);
  token = null;
}

function headers(more = {}) {
  return token ? { ...more, Authorization: `Bearer ${token}` } : more;
}

/** Asks the person for the token; all who need it wait for the same answer. */
function enter(wrong) {
  entering ??= new Promise((resolve) => {
    const dialog = document.getElementById('enter');
    document.getElementById('enter-wrong').textContent = wrong;
    dialog.addEventListener('close', () => {
      token = document.getElementById('token').value.trim();
      document.getElementById('token').value = '';
      const store = document.getElementById('keep').checked ? localStorage : sessionStorage;
      store.setItem(KEY, token);
      entering = null;
      resolve();
    }, { once: true });
    dialog.addEventListener('cancel', (event) => event.preventDefault());
    dialog.showModal();
  });
  return entering;
}

async function request(path, options = {}) {
  for (;;) {
    const given = token;
    const answer = await fetch(path, { ...options, headers: headers(options.headers), cache: 'no-store' });
    if (answer.status !== 401) return answer;
    if (given === token) {
      const wrong = token ? 'That is not the token of this site.' : '';
      forget();
      await enter(wrong);
    }
  }
}

/** The JSON at a path; `signal` ends the wait. */
export async function get(path, parameters = {}, signal = undefined) {
  const given = Object.entries(parameters).filter(([, value]) => value !== null && value !== undefined);
  const query = new URLSearchParams(given).toString();
  const answer = await request(query ? `${path}?${query}` : path, { signal });
  if (!answer.ok) throw new Refused((await answer.text()).trim() || `${path}: ${answer.status}`);
  return answer.json();
}

/** Gives an order. */
export async function order(what) {
  const options = { method: 'POST', body: JSON.stringify(what), headers: { 'Content-Type': 'application/json' } };
  const answer = await request('/api/orders', options);
  if (!answer.ok) throw new Refused((await answer.text()).trim());
  return answer.json();
}

/** The daemon says something each second; a connection that is silent for so long is dead. */
const SILENT_MS = 10000;

/** Follows the changes for ever: `changed` at each, `lost` and `found` as the connection goes and comes. */
export async function follow({ changed, lost, found }) {
  let since = null;
  for (;;) {
    const dead = new AbortController();
    let timer = setTimeout(() => dead.abort(), SILENT_MS);
    try {
      const path = since === null ? '/api/stream' : `/api/stream?since=${since}`;
      const answer = await request(path, { signal: dead.signal });
      if (!answer.ok) throw new Error(`stream: ${answer.status}`);
      found();
      const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
      let text = '';
      for (;;) {
        const { done, value } = await reader.read();
        clearTimeout(timer);
        if (done) break;
        timer = setTimeout(() => dead.abort(), SILENT_MS);
        const messages = (text + value).split('\n\n');
        text = messages.pop();
        for (const message of messages) {
          const id = /^id: (\d+)$/m.exec(message);
          if (id) {
            since = Number(id[1]);
            changed();
          }
        }
      }
    } catch {
      clearTimeout(timer);
      lost();
      await new Promise((wake) => setTimeout(wake, 2000));
    }
  }
}

// Talks to `synth serve`: each request carries the token of this run, which came with the page's address.

const token = new URLSearchParams(location.search).get('token') ?? '';

function addressOf(path, parameters = {}) {
  return `${path}?${new URLSearchParams(parameters)}`;
}

async function asked(path, parameters, options = {}) {
  let reply;
  try {
    reply = await fetch(addressOf(path, parameters), { ...options, headers: { 'X-Mouthpiece-Token': token } });
  } catch {
    throw new Error('The program does not answer: it was ended, or is busy. Start it again and open the address that it prints.');
  }
  const told = await reply.json().catch(() => ({}));
  if (!reply.ok) throw new Error(told.error ?? `The program answers ${reply.status}`);
  return told;
}

export const state = () => asked('/state');
export const post = (path, parameters, body) => asked(path, parameters, { method: 'POST', body });
/** An address for a frame or a download, which cannot send headers. */
export const address = (path, parameters) => addressOf(path, { ...parameters, token });

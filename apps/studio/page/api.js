// The server's answers. Every function throws an Error whose message is the server's sentence.

async function answer(response) {
  const json = await response.json().catch(() => ({error: `the server answered ${response.status}`}));
  if (!response.ok) throw new Error(json.error);
  return json;
}

async function post(address, body, options = {}) {
  return answer(await fetch(address, {
    method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(body),
    ...options}));
}

export const images = async () => answer(await fetch('api/images'));
export const session = async (image) => answer(await fetch(`api/session/${image}`));
export const detect = (image) => post('api/detect', {image});
export const estimate = (request) => post('api/estimate', request);
export const save = (image, scene) => post('api/save', {image, scene});
export const exportPose = (request) => post('api/export', request);
// `leaving`: the page is about to go, and the request is to outlive it, which browsers promise of
// small ones only.
export const draft = (image, state, leaving = false) =>
  post('api/draft', {image, state}, {keepalive: leaving && JSON.stringify(state).length < 60000});

// {bitmap, width, height}: a large photo's bitmap has fewer pixels than the photo.
export async function photo(image) {
  const response = await fetch(`api/image/${image}`);
  if (!response.ok) await answer(response);
  const [width, height] = response.headers.get('X-Photo-Size').split('x').map(Number);
  return {bitmap: await createImageBitmap(await response.blob()), width, height};
}

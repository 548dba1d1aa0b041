// Elements, and nothing but elements: text never becomes markup.

/** h('a', {href: '#x', class: 'link', onclick: f}, 'text', element, [more]) */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name === 'style') Object.assign(element.style, value);
    else element.setAttribute(name, value === true ? '' : value);
  }
  add(element, children);
  return element;
}

function add(element, children) {
  for (const child of children.flat(Infinity))
    if (child !== null && child !== undefined && child !== false) element.append(child);
}

/** Replaces what is in an element. */
export function fill(element, ...children) {
  element.replaceChildren();
  add(element, children);
  return element;
}

/** A titled part of the page. `id` makes it reachable by the page's own links. */
export function section(title, {id, note, wide} = {}, ...children) {
  return h(
    'section',
    {id, class: wide ? 'wide' : null, 'aria-label': title},
    h('h2', {}, title),
    note ? h('p', {class: 'note'}, note) : null,
    children,
  );
}

/** A button; `pressed`: it is one of two states. */
export function button(text, onclick, {title, pressed, class: name} = {}) {
  const state = pressed === undefined ? null : String(pressed);
  return h('button', {type: 'button', class: name, title, onclick, 'aria-pressed': state}, text);
}

/** A choice with a label. options: [[value, text], ...]. */
export function choice(label, options, value, onchange) {
  const select = h(
    'select',
    {onchange: () => onchange(select.value)},
    options.map(([key, text]) => h('option', {value: key, selected: key === value}, text)),
  );
  return h('label', {class: 'choice'}, h('span', {}, label), select);
}

/** A function that calls draw in the next frame, once however often it is called before. */
export function soon(draw, wait = requestAnimationFrame) {
  let isDue = false;
  return () => {
    if (isDue) return;
    isDue = true;
    wait(() => {
      isDue = false;
      draw();
    });
  };
}

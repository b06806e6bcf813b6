/** Small helpers for the page's elements. */

/** @param {string} tag @param {object} attributes `on…` are listeners, `text` the content */
export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === 'text') node.textContent = value;
    else if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, '');
    else if (value !== false && value !== undefined && value !== null) node.setAttribute(name, value);
  }
  node.append(...children.filter(Boolean));
  return node;
}

export function clockText(seconds) {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(1).padStart(4, '0')}`;
}

/** A button whose pressed state is shown. */
export function toggleButton(text, label, onclick) {
  return el('button', {type: 'button', text, 'aria-label': label, title: label, 'aria-pressed': 'false', onclick});
}

export function setPressed(button, on) {
  button.setAttribute('aria-pressed', String(on));
}

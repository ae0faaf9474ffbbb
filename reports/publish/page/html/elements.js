// Building the page. Text only ever becomes a text node, so no name or message can turn into markup.
(function (rayproof) {
  "use strict";

  // element("p", {class: "note", onclick: f}, "text", child, [children], null) -> HTMLElement
  rayproof.element = function (tag, attributes, ...children) {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes || {})) {
      if (value === null || value === undefined || value === false) continue;
      if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
      else if (name === "value") node.value = value;
      else node.setAttribute(name, value === true ? "" : String(value));
    }
    rayproof.append(node, children);
    return node;
  };

  rayproof.append = function (node, children) {
    for (const child of children.flat(Infinity)) {
      if (child === null || child === undefined || child === false) continue;
      node.append(child instanceof Node ? child : document.createTextNode(String(child)));
    }
    return node;
  };

  // Named by the browser itself, so that no address stands in the page.
  const SVG = new DOMParser().parseFromString("<svg></svg>", "text/html").body.firstChild.namespaceURI;

  // The same for parts of a drawing; attributes that are null are left out.
  rayproof.svg = function (tag, attributes, ...children) {
    const node = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) if (value !== null) node.setAttribute(name, String(value));
    return rayproof.append(node, children);
  };

  rayproof.replace = function (node, ...children) {
    node.replaceChildren();
    return rayproof.append(node, children);
  };

  // What is wider than the window scrolls by itself; the keyboard reaches it though nothing in it takes the focus.
  rayproof.scroll = (label, ...children) => rayproof.element("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": label }, children);

  // A <select> of [value, label] pairs; a third entry says why there is no such choice now.
  rayproof.select = function (label, pairs, current, onchange) {
    const e = rayproof.element;
    const options = pairs.map(([value, text, why]) => e("option", { value, disabled: Boolean(why) }, why ? `${text}: ${why}` : text));
    const node = e("select", { "aria-label": label, onchange: () => onchange(node.value) }, options);
    node.value = current;
    return e("label", { class: "control" }, e("span", {}, label), node);
  };
})(window.rayproof = window.rayproof || {});

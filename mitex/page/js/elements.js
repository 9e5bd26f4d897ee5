// Parts of the panel. Texts are set as text: names come from files, and none of them is markup.

function element(tag, values = {}, ...children) {
  const { className, ...rest } = values;
  const node = document.createElement(tag);
  if (className) node.className = className;
  for (const [key, value] of Object.entries(rest)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (value !== undefined) node.setAttribute(key, value === true ? "" : value);
  }
  node.append(...children);
  return node;
}

const section = (title, ...children) => element("section", {}, element("h2", {}, title), ...children);

function button(text, title, act, className = "") {
  return element("button", { type: "button", title, className, onclick: act }, text);
}

// A slider with its name and value; `text` says how the value reads.
function slider(name, { low, high, step, value, text = String, id }, act) {
  const shown = element("output", {}, text(value));
  const input = element("input", { type: "range", min: low, max: high, step, value, id, "aria-label": name });
  input.addEventListener("input", () => {
    shown.textContent = text(Number(input.value));
    act(Number(input.value));
  });
  const set = (next) => {
    input.value = next;
    shown.textContent = text(Number(input.value));
  };
  return Object.assign(element("label", { className: "slider" }, element("span", {}, name), shown, input), { set });
}

// Buttons of which one is on.
function choice(name, options, chosen, act) {
  const buttons = options.map(([key, text, title]) => button(text, title ?? text, () => act(key)));
  const group = element("div", { className: "choice", role: "group", "aria-label": name }, ...buttons);
  const set = (key) => options.forEach(([one], k) => buttons[k].setAttribute("aria-pressed", String(one === key)));
  set(chosen);
  return Object.assign(group, { set });
}

// A list of which one is chosen.
function menu(name, options, chosen, act) {
  const rows = options.map(([key, text]) => element("option", { value: key, selected: key === chosen || undefined }, text));
  const list = element("select", { "aria-label": name, onchange: () => act(list.value) }, ...rows);
  return list;
}

// Pictures of which one is chosen; a look without one has its name alone.
function gallery(names, pictures, chosen, act) {
  const items = names.map((name, k) => element("button",
    { type: "button", title: name, "aria-pressed": String(k === chosen), onclick: () => act(k) },
    ...(pictures[k] ? [element("img", { src: pictures[k], alt: "" })] : []), element("span", {}, name)));
  return element("div", { className: "gallery", role: "group", "aria-label": "Look" }, ...items);
}

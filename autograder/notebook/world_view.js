// The live view of a world. Python sends what it shows (`world_view.py`); this draws it and sends back what a person does.
// It uses the page's own colours, so that it suits light and dark themes, and no colour alone tells anything.

const SVG = "http://www.w3.org/2000/svg";
const STEER = { ArrowUp: [0.5, 0], ArrowDown: [-0.4, 0], ArrowLeft: [0, 1.5], ArrowRight: [0, -1.5] };
const HERE_EVERY = 1000; // ms between two messages that say that somebody looks
const STEER_EVERY = 100; // ms between two commands while a key is down
const TRAIL_KEPT = 3000; // points of a trail
const MARKS_KEPT = 1000; // brakes, and touches
const NEWS_KEPT = 4; // sentences that stay visible
const LATE_AFTER = 2000; // ms without a message after which a sentence says so

function element(parent, name, attributes = {}, text = "") {
  const svg = parent.namespaceURI === SVG || name === "svg";
  const made = svg ? document.createElementNS(SVG, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text) made.textContent = text;
  parent.append(made);
  return made;
}

// Draws the room once, with the cars where they were when the view began; gives a function that draws what moves.
function drawRoom(box, room, cars, poses) {
  const { width, height } = room;
  const svg = element(box, "svg", { viewBox: `0 0 ${width} ${height}`, role: "img", class: "aw-map" });
  const title = element(svg, "title", {}, `A room of ${width} m by ${height} m, seen from above`);
  title.id = `aw-${Math.random().toString(36).slice(2)}`;
  svg.setAttribute("aria-labelledby", title.id);
  const hatch = element(element(svg, "defs"), "pattern", {
    id: `${title.id}-hatch`, width: 0.12, height: 0.12, patternUnits: "userSpaceOnUse",
  });
  element(hatch, "path", { d: "M0 0.12L0.12 0M0 0L0.12 0.12", class: "aw-thin" });
  const up = element(svg, "g", { transform: `matrix(1 0 0 -1 0 ${height})` }); // y points up in the world
  const rectangle = (parent, [x, y, w, h], attributes) =>
    element(parent, "rect", { x, y, width: w, height: h, ...attributes });
  for (const place of room.places) {
    for (const one of place.blocks) rectangle(up, one, { class: "aw-place" });
    const [x, y, w, h] = place.blocks[0];
    const down = h > 0.36 ? 0.18 : h / 2; // at the upper edge, because a car that has arrived stands in the middle
    element(svg, "text", { x: x + w / 2, y: height - y - h + down, class: "aw-name" }, place.name);
  }
  for (const one of room.walls) rectangle(up, one, { class: "aw-wall" });
  for (const one of room.boxes) {
    rectangle(up, one, { class: "aw-box" });
    rectangle(up, one, { fill: `url(#${title.id}-hatch)` });
  }
  const trails = cars.map((_, number) => element(up, "path", { class: `aw-trail aw-car${number % 4}` }));
  const rays = cars.map(() => element(up, "path", { class: "aw-rays" }));
  const brakes = element(up, "g");
  const touches = element(up, "g");
  const [long, wide] = room.car;
  const drawCar = (look) => {
    const group = element(up, "g");
    rectangle(group, [-long / 2, -wide / 2, long, wide], { class: `aw-body ${look}` });
    element(group, "path", {
      d: `M${long / 2} 0L0.02 ${wide / 2.6}L0.02 ${-wide / 2.6}Z`, class: "aw-nose",
    });
    return group;
  };
  const turn = (group, [x, y, heading]) =>
    group.setAttribute("transform", `translate(${x} ${y}) rotate(${(heading * 180) / Math.PI})`);
  for (const pose of room.parked) turn(drawCar("aw-parked"), pose);
  const bodies = cars.map((_, number) => drawCar(`aw-car${number % 4}`));
  const names = cars.map((name) => element(svg, "text", { class: "aw-name" }, name));
  const put = (number, pose) => {
    turn(bodies[number], pose);
    names[number].setAttribute("x", pose[0]);
    names[number].setAttribute("y", height - pose[1] - wide);
  };
  poses.forEach((pose, number) => put(number, pose));
  const paths = cars.map(() => []);
  return (message) => {
    message.cars.forEach((car, number) => {
      put(number, car.pose);
      if (message.whole) paths[number] = [];
      const [lastX, lastY] = paths[number].at(-1) ?? [];
      paths[number].push(...car.trail.filter(([x, y]) => x !== lastX || y !== lastY)); // standing adds nothing
      paths[number] = paths[number].slice(-TRAIL_KEPT);
      const step = ([x, y, jumped], place) => `${jumped || !place ? "M" : "L"}${x} ${y}`;
      trails[number].setAttribute("d", paths[number].map(step).join(""));
      const [x, y] = car.pose;
      rays[number].setAttribute("d", car.rays.map(([to, at]) => `M${x} ${y}L${to} ${at}`).join(""));
    });
    if (message.whole) brakes.replaceChildren(), touches.replaceChildren(); // else only new marks come
    for (const [x, y] of message.brakes) rectangle(brakes, [x - 0.05, y - 0.05, 0.1, 0.1], { class: "aw-brake" });
    for (const [x, y] of message.touches) {
      const mark = element(touches, "g");
      element(mark, "circle", { cx: x, cy: y, r: 0.1, class: "aw-touch" });
      element(mark, "path", { d: `M${x - 0.05} ${y - 0.05}l0.1 0.1m0 -0.1l-0.1 0.1`, class: "aw-touch" });
    }
    for (const marks of [brakes, touches]) while (marks.children.length > MARKS_KEPT) marks.firstChild.remove();
  };
}

// Changes a text only if it is another one: each change is an event that a screen reader has to work through.
function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

function button(parent, text, press) {
  const made = element(parent, "button", { type: "button" }, text);
  made.addEventListener("click", press);
  return made;
}

// The arrow keys, while the pad has the focus.
function steering(pad, send) {
  const down = new Set();
  let timer = 0;
  const steer = () => {
    const sum = [...down].reduce(([a, b], key) => [a + STEER[key][0], b + STEER[key][1]], [0, 0]);
    send({ do: "drive", speed: sum[0], turn: sum[1] });
  };
  const stop = () => {
    down.clear();
    clearInterval(timer);
    if (timer) send({ do: "drive", speed: 0, turn: 0 });
    timer = 0;
  };
  pad.addEventListener("keydown", (event) => {
    if (!(event.key in STEER)) return;
    event.preventDefault(); // neither the page nor the notebook moves
    event.stopPropagation();
    down.add(event.key);
    if (!timer) timer = setInterval(steer, STEER_EVERY);
    if (!event.repeat) steer();
  });
  pad.addEventListener("keyup", (event) => {
    if (!(event.key in STEER)) return;
    event.stopPropagation();
    down.delete(event.key);
    if (!down.size) stop();
  });
  pad.addEventListener("blur", stop);
  return stop;
}

function render({ model, el }) {
  const { room, cars, poses, still, buttons: own } = model.get("scene");
  el.classList.add("aw-view");
  // The picture below, which stands for this view where it cannot be shown, is not needed while this view is shown.
  const hidden = element(el, "style", {}, `.${still} { display: none; }`);
  const shadow = element(el, "div", { class: "aw-columns" });
  const left = element(shadow, "div", { class: "aw-left" });
  const move = drawRoom(left, room, cars, poses);
  const waits = element(left, "div", { class: "aw-waits", role: "status" });
  const right = element(shadow, "div", { class: "aw-right" });
  let car = 0;
  const send = (content) => model.send({ car, ...content });

  const buttons = element(right, "div", { class: "aw-buttons", role: "group", "aria-label": "The world" });
  const pause = button(buttons, "Pause", () => send({ do: "pause" }));
  button(buttons, "Reset", () => send({ do: "reset" }));
  const kills = new Map(); // a program may be started later
  const kill = (name) => {
    if (!kills.has(name)) kills.set(name, button(buttons, `Kill ${name}`, () => send({ do: "kill", name })));
    return kills.get(name);
  };

  if (own.length) {
    const row = element(right, "div", { class: "aw-buttons", role: "group", "aria-label": "The programs" });
    for (const name of own) button(row, name, () => send({ do: "press", name }));
  }

  // In an application a screen reader leaves the arrow keys to the page. It reads the name of what has the focus in it.
  const keys = element(right, "div", { role: "application", "aria-label": "Steering" });
  const pad = element(
    keys, "div",
    { class: "aw-pad", tabindex: 0, role: "group", "aria-label": "Drive with the arrow keys", "data-lm-suppress-shortcuts": "true" },
    "Click here, or come here with Tab, and drive with the arrow keys.",
  );
  const stop = steering(pad, send);
  if (cars.length > 1) {
    const label = element(right, "label", {}, "Drive the car ");
    const choice = element(label, "select");
    cars.forEach((name, number) => element(choice, "option", { value: number }, name));
    choice.addEventListener("change", () => { stop(); car = Number(choice.value); });
  }

  const meters = element(right, "div", { class: "aw-meters" });
  const speeds = cars.map((name) => {
    const row = element(meters, "div");
    element(row, "span", {}, `${name || "speed"} `);
    const meter = element(row, "meter", { min: 0, max: 1, value: 0, "aria-label": `speed ${name}` });
    return { meter, text: element(row, "span", { class: "aw-figure", "aria-hidden": "true" }), state: element(meters, "div", { class: "aw-state" }) };
  });
  const table = element(right, "table");
  element(table, "caption", {}, "Messages a second");
  const rates = element(table, "tbody");
  const log = element(el, "div", { role: "log", "aria-live": "polite", "aria-label": "What happens" });
  const news = element(log, "ul", { class: "aw-news" });

  let came = 0; // when the last message came
  const sayWhetherLate = () => {
    if (!came) write(waits, "The cars are shown where they were when the cell ran. The view waits for the kernel.");
    else if (Date.now() - came > LATE_AFTER) write(waits, "The picture stands still, because no message comes from the kernel.");
    else write(waits, "");
  };
  sayWhetherLate();
  const show = (message) => {
    if (message.gone) {
      clearInterval(here);
      stop();
      el.innerHTML = message.gone; // the picture, as an `<img>` of Python's own making
      el.append(hidden);
      return;
    }
    came = Date.now();
    sayWhetherLate();
    move(message);
    write(pause, message.paused ? "Go on" : "Pause");
    message.cars.forEach(({ speed, state }, number) => {
      speeds[number].meter.value = Math.abs(speed);
      write(speeds[number].text, ` ${speed.toFixed(2)} m/s`); // the meter tells it to a screen reader
      write(speeds[number].state, state);
    });
    for (const [name, runs] of Object.entries(message.running)) {
      const made = kill(name);
      const ended = !runs;
      made.setAttribute("aria-disabled", ended); // a button that is disabled would lose the focus
      write(made, ended ? `${name} has ended` : `Kill ${name}`);
    }
    const rows = message.rates.flatMap(([topic, rate, said]) => [[topic, rate.toFixed(0)], ...(said ? [[said]] : [])]);
    while (rates.children.length > rows.length) rates.lastChild.remove();
    rows.forEach((texts, number) => {
      const row = rates.children[number] ?? element(rates, "tr");
      if (row.children.length !== texts.length) {
        row.replaceChildren();
        if (texts.length === 1) element(row, "td", { colspan: 2, class: "aw-said" });
        else element(row, "th", { scope: "row" }), element(row, "td");
      }
      texts.forEach((text, place) => write(row.children[place], text));
    });
    for (const sentence of message.news) element(news, "li", {}, sentence);
    while (news.children.length > NEWS_KEPT) news.firstChild.remove();
  };
  model.on("msg:custom", show);
  send({ do: "begin" });
  const here = setInterval(() => {
    if (document.visibilityState !== "visible") return;
    send({ do: "here" });
    sayWhetherLate();
  }, HERE_EVERY);
  return () => {
    clearInterval(here);
    stop();
    model.off("msg:custom", show);
  };
}

export default { render };

// Shows the coverage of free presses, from hivtac-calibrate: a map for each range of forces.

const WORDS = { covered: "covered", begun: "begun", missing: "missing", unneeded: "not needed" };

export class Coverage {
  constructor(part) {
    this.part = part;
    this.shown = "";
  }

  /** Shows a coverage; hides it when `told` is null because no presses are recorded. */
  show(told) {
    const text = JSON.stringify(told);
    if (text === this.shown) return;
    this.shown = text;
    this.part("coverage").hidden = told === null;
    if (told === null) return;
    this.part("maps").replaceChildren(...told.maps.map(map));
    this.part("pressed").textContent = told.now;
    this.part("covered").textContent = told.line;
  }
}

function map({ name, places, pressed }) {
  const table = document.createElement("table");
  table.createCaption().textContent = name;
  places.forEach((row, y) => {
    const line = table.insertRow();
    row.forEach((covered, x) => {
      const cell = line.insertCell();
      const isPressed = pressed !== null && pressed[0] === y && pressed[1] === x;
      cell.className = isPressed ? `${covered} pressed` : covered;
      cell.title = isPressed ? `${WORDS[covered]}, pressed now` : WORDS[covered];
    });
  });
  return table;
}

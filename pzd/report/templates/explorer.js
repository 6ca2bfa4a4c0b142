// The explorer of the records: four linked plots of any tests, the force of the table, and the values under the cursor.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("explorer-data").textContent);
  const by = (id) => document.getElementById(id);
  const GREY = "#4d4d4d", ORANGE = "#d55e00", BLUE = "#0072b2";
  const PALETTE = ["#4d4d4d", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a5195"];
  const CURVES = [["measured", "F", GREY, "solid"], ["baseline", "B", ORANGE, "dashed"], ["final", "A", BLUE, "dotdash"]];
  const curves = CURVES.filter(([name]) => data.curves[name]);
  const axes = {v: "velocity [m/s]", x: "displacement [mm]", t: "time [s]"};
  const tools = "pan,wheel_zoom,box_zoom,reset";

  const figure = (x, y, more) => Bokeh.Plotting.figure({
    x_axis_label: x, y_axis_label: y, height: 300, sizing_mode: "stretch_width", tools: tools, ...more,
  });
  const overV = figure(axes.v, "force [N]"), overX = figure(axes.x, "force [N]", {y_range: overV.y_range});
  const overT = figure(axes.t, "force [N]", {y_range: overV.y_range});
  const rest = figure(axes.t, "measured less model [N]", {x_range: overT.x_range});
  const steady = data.table.length ? figure("velocity [m/s]", "force of the table [N]") : null;
  const plots = [[overV, "v", false], [overX, "x", false], [overT, "t", false], [rest, "t", true]];

  for (const [name, , colour, dash] of curves)  // the box of each curve stands on a sample of its line
    by(`explorer-${name}`).parentElement.style.borderBottom = `3px ${dash === "solid" ? "solid" : "dashed"} ${colour}`;

  // --- What is drawn ---

  const drawn = new Map();
  const chosen = () => [...by("explorer-tests").selectedOptions].map((option) => Number(option.value));
  const wanted = (name) => by(`explorer-${name}`).checked;

  const draw = (place) => {
    const test = data.tests[place];
    const columns = {t: test.t, x: test.x, v: test.v};
    for (const [, key] of curves) {
      columns[key] = test[key];
      columns[`d${key}`] = test[key].map((force, i) => test.F[i] - force);
    }
    const source = new Bokeh.ColumnDataSource({data: columns});
    const lines = plots.flatMap(([plot, x, difference]) => curves
      .filter(([name]) => !(difference && name === "measured"))
      .map(([name, key, colour, dash]) => ({name, colour, line: plot.line({field: x}, {field: difference ? `d${key}` : key}, {
        source, line_color: colour, line_dash: dash, line_width: name === "measured" ? 2.5 : 1.5,
      })})));
    drawn.set(place, {columns, lines});
  };

  const show = () => {
    const places = chosen();
    places.filter((place) => !drawn.has(place)).forEach(draw);
    for (const [place, {lines}] of drawn)
      for (const {name, colour, line} of lines) {
        line.visible = places.includes(place) && wanted(name);
        line.glyph.line_color = {value: places.length > 1 ? PALETTE[places.indexOf(place) % PALETTE.length] : colour};
      }
    by("explorer-key").replaceChildren(...places.map((place, i) => {
      const item = document.createElement("li");
      item.textContent = data.tests[place].label;
      if (places.length > 1) item.style.color = PALETTE[i % PALETTE.length];
      return item;
    }));
  };

  // --- The cursor: the nearest sample of what is drawn, marked in every plot ---

  const marks = plots.map(([plot]) => {
    const source = new Bokeh.ColumnDataSource({data: {x: [], y: []}});
    plot.scatter({field: "x"}, {field: "y"}, {source, size: 9, fill_color: "white", line_color: "black", line_width: 1.5});
    return source;
  });

  const nearest = (plot, x, difference, event) => {
    const span = (range) => (range.end - range.start) || 1, found = {distance: Infinity};
    for (const place of chosen()) {
      const columns = drawn.get(place).columns, ys = difference ? columns[`d${curves.at(-1)[1]}`] : columns.F;
      for (let i = 0; i < ys.length; i++) {
        const distance = Math.hypot((columns[x][i] - event.x) / span(plot.x_range), (ys[i] - event.y) / span(plot.y_range));
        if (distance < found.distance) Object.assign(found, {distance, place, i});
      }
    }
    return found;
  };

  const put = (id, value, digits) => { by(`explorer-${id}`).textContent = value.toFixed(digits).replace("-", "\u2212"); };

  for (const [plot, x, difference] of plots)
    plot.on_event("mousemove", (event) => {
      const {place, i} = nearest(plot, x, difference, event);
      if (place === undefined) return;
      const {columns} = drawn.get(place);
      plots.forEach(([, key, less], n) => {
        marks[n].data = {x: [columns[key][i]], y: [less ? columns[`d${curves.at(-1)[1]}`][i] : columns.F[i]]};
      });
      by("explorer-test").textContent = data.tests[place].label;
      put("t", columns.t[i], 4); put("x", columns.x[i], 3); put("v", columns.v[i], 4);
      for (const [name, key] of curves) {
        put(`value-${name}`, columns[key][i], 0);
        if (name !== "measured") put(`less-${name}`, columns[`d${key}`][i], 1);
      }
    });

  // --- Force over speed of the table ---

  const table = data.table.map((curve, n) => {
    const source = new Bokeh.ColumnDataSource({data: {v: curve.v, F: curve.F}});
    return steady.line({field: "v"}, {field: "F"}, {
      source, line_color: PALETTE[n % PALETTE.length], line_width: 2, legend_label: curve.label,
    });
  });
  const showTable = () => {
    const places = [...by("explorer-levels").selectedOptions].map((option) => Number(option.value));
    table.forEach((line, n) => { line.visible = places.includes(n); });
  };
  if (steady) {
    steady.legend.location = "top_left";
    steady.legend.click_policy = "hide";
  }

  // --- On the page ---

  by("explorer").hidden = false;
  show();
  const all = [overV, overX, overT, rest], two = window.innerWidth > 800;
  const grid = two ? [[overV, overX], [overT, rest]] : all.map((plot) => [plot]);
  const options = {toolbar_location: "above", sizing_mode: "stretch_width", merge_tools: true};
  Bokeh.Plotting.show(Bokeh.Plotting.gridplot(grid, options), by("explorer-plots"));
  if (steady) Bokeh.Plotting.show(steady, by("explorer-table"));
  for (const id of ["explorer-tests", ...curves.map(([name]) => `explorer-${name}`)]) by(id).addEventListener("change", show);
  if (steady) { by("explorer-levels").addEventListener("change", showTable); showTable(); }
})();

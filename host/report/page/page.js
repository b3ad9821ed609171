'use strict';
// The report's page: for each scene and light a plot, pictures, and a table. Data is in the page's two JSON elements.
(function () {
  const report = JSON.parse(document.getElementById('report').textContent);
  const pictures = JSON.parse(document.getElementById('pictures').textContent);
  const main = document.getElementById('main'), tip = document.getElementById('tip');
  const methodNames = [];
  const cases = [];
  for (const scene of report.scenes)
    for (const light of scene.lights) {
      cases.push({scene, light});
      for (const r of light.results)
        if (r.kind === 'method' && !methodNames.includes(r.method)) methodNames.push(r.method);
    }
  const colorOf = r => r.kind === 'rival' ? 'var(--rays)' : `var(--c${methodNames.indexOf(r.method) % 10})`;
  // Rivals are diamonds, adaptive ones triangles; ours are circles.
  const shapeOf = r => r.kind !== 'rival' ? 'circle' : r.method === 'rays' ? 'diamond' : 'triangle-up';
  const symbolOf = r => d3.svg.symbol().type(shapeOf(r)).size(r.is_default ? 150 : 90)();

  // ------------------------------------------------------------------------------------------------------------ helpers

  function element(name, attributes, ...children) {
    const e = document.createElement(name);
    for (const [key, value] of Object.entries(attributes || {})) {
      if (key.startsWith('on')) e.addEventListener(key.slice(2), value);
      else if (value !== false && value !== null && value !== undefined) e.setAttribute(key, value === true ? '' : value);
    }
    e.append(...children);
    return e;
  }
  const ms = value => value >= 100 ? value.toFixed(0) : value >= 10 ? value.toFixed(1) : value.toFixed(2);
  const settingsText = r => Object.entries(r.settings).map(([k, v]) => `${k.replace(/_px$/, '').replace(/_/g, ' ')} ${v}`).join(', ');
  const titleOf = r => settingsText(r) ? `${r.method}: ${settingsText(r)}` : r.method;
  // How many times as long rays take for the same penumbra error. Not for rays themselves.
  const speedupOf = r => r.kind === 'rival' || r.rays_time_at_error_ms === null ? null : r.rays_time_at_error_ms / r.time_ms.median;

  // --------------------------------------------------------------------------------------------------------------- head

  document.getElementById('lead').textContent = 'Each point is a method with its settings: the time from meshes and G-buffer to the ' +
    'finished shadow, against its error in the penumbra. The truth is ray-traced' +
    ` with ${report.truth_samples} samples of the light; rays with fewer samples are the rival.`;
  const facts = [['Device', `${report.device.name} (${report.device.platform}, driver ${report.device.driver})`],
    ['Rays on', `${report.host}, Embree, ${cases.length ? cases[0].light.rays_threads : '?'} threads`],
    ['Version', `halfshade ${report.version}` + (report.commit ? `, commit ${report.commit}` : '')],
    ['Date', report.date], ['Runs', `median of ${report.repeats}, in turns, after a warm-up`]];
  const list = document.getElementById('facts');
  for (const [name, text] of facts) list.append(element('dt', {}, name), element('dd', {}, text));
  list.append(element('dt', {}, 'Command'), element('dd', {}, element('code', {}, report.command)));
  if (!report.complete) list.append(element('dt', {}, 'Note'), element('dd', {}, 'This report is not complete: run the command again to go on.'));

  // ------------------------------------------------------------------------------------------------------------ pictures

  const loaded = new Map();
  /// Pixels of a picture of the page: {width, height, data: RGBA}.
  function pixelsOf(name) {
    if (!loaded.has(name)) {
      loaded.set(name, new Promise((resolve, reject) => {
        const image = new Image();
        image.onload = () => {
          const canvas = element('canvas', {width: image.width, height: image.height});
          const context = canvas.getContext('2d', {willReadFrequently: true});
          context.drawImage(image, 0, 0);
          resolve(context.getImageData(0, 0, image.width, image.height));
        };
        image.onerror = () => reject(new Error('picture ' + name + ' cannot be decoded'));
        image.src = pictures[name];
      }));
      // Only the last few stay decoded: each takes four bytes a pixel.
      for (const key of loaded.keys()) if (loaded.size > 12) loaded.delete(key); else break;
    }
    return loaded.get(name);
  }

  const linear = new Float32Array(256), encoded = new Uint8ClampedArray(4097);
  for (let i = 0; i < 256; ++i) linear[i] = i <= 10 ? i / 255 / 12.92 : Math.pow((i / 255 + 0.055) / 1.055, 2.4);
  for (let i = 0; i <= 4096; ++i) {
    const x = i / 4096;
    encoded[i] = 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.pow(x, 1 / 2.4) - 0.055) + 0.5;
  }

  /// Signed error to colour: blue is too dark, red too light, white none; strongest at `range`.
  function errorColor(error, range, out, at) {
    const t = Math.max(-1, Math.min(1, error / range)), s = Math.sqrt(Math.abs(t));
    const to = t < 0 ? [33, 82, 190] : [190, 30, 38];
    for (let c = 0; c < 3; ++c) out[at + c] = 247 + (to[c] - 247) * s;
    out[at + 3] = 255;
  }
  const errorRange = 0.5;

  /// A view of visibility: itself, the picture shaded with it, or its signed error.
  async function view(mode, light, name) {
    const seen = await pixelsOf(name);
    if (mode === 'visibility') return seen;
    const out = new ImageData(seen.width, seen.height), data = out.data, v = seen.data;
    if (mode === 'error') {
      const truth = (await pixelsOf(light.pictures.truth.picture)).data;
      for (let i = 0; i < data.length; i += 4) errorColor((v[i] - truth[i]) / 255, errorRange, data, i);
      return out;
    }
    const dark = (await pixelsOf(light.pictures.dark.picture)).data, lit = (await pixelsOf(light.pictures.lit.picture)).data;
    for (let i = 0; i < data.length; i += 4) {
      const t = v[i] / 255;
      for (let c = 0; c < 3; ++c) {
        const low = linear[dark[i + c]];
        data[i + c] = encoded[Math.round(4096 * (low + t * (linear[lit[i + c]] - low)))];
      }
      data[i + 3] = 255;
    }
    return out;
  }

  async function paint(canvas, mode, light, name, width) {
    const image = await view(mode, light, name);
    const full = element('canvas', {width: image.width, height: image.height});
    full.getContext('2d').putImageData(image, 0, 0);
    canvas.width = width || image.width;
    canvas.height = Math.round(canvas.width * image.height / image.width);
    canvas.getContext('2d').drawImage(full, 0, 0, canvas.width, canvas.height);
  }

  // --------------------------------------------------------------------------------------------------------------- plot

  function plot(light, choose) {
    // On a phone the drawing is narrower, so that its text keeps its size.
    const width = innerWidth < 640 ? 420 : 900, height = innerWidth < 640 ? 380 : 460, margin = {left: 50, right: 14, top: 28, bottom: 44};
    // A scene without penumbra has no error to plot there.
    const shown = light.results.filter(r => r.figures.penumbra_rmse > 0 && r.time_ms.median > 0);
    const holder = element('div', {class: 'panel'});
    if (!shown.length) {
      holder.append(element('p', {}, 'No penumbra in sight: nothing to plot.'));
      return holder;
    }
    const pad = (extent, by) => [extent[0] / by, extent[1] * by];
    const x = d3.scale.log().domain(pad(d3.extent(shown, r => r.time_ms.median), 1.25)).range([margin.left, width - margin.right]);
    const y = d3.scale.log().domain(pad(d3.extent(shown, r => r.figures.penumbra_rmse), 1.3)).range([height - margin.bottom, margin.top]);
    const svg = d3.select(holder).append('svg').attr({viewBox: `0 0 ${width} ${height}`, class: 'plot', role: 'group',
      'aria-label': 'Time against penumbra error, both logarithmic; points are listed in the table below'});
    const lead = d => Math.round(10 * d / Math.pow(10, Math.floor(Math.log(d) / Math.LN10 + 1e-9))) / 10;
    const label = few => d => (few ? [1] : [1, 2, 5]).includes(lead(d)) ? d3.format('g')(+d.toPrecision(2)) : '';
    const decades = scale => Math.log(scale.domain()[1] / scale.domain()[0]) / Math.LN10;
    svg.append('g').attr({class: 'axis', transform: `translate(0,${height - margin.bottom})`})
      .call(d3.svg.axis().scale(x).orient('bottom').tickSize(-(height - margin.top - margin.bottom)).tickFormat(label(decades(x) > (width > 640 ? 4 : 2))));
    svg.append('g').attr({class: 'axis', transform: `translate(${margin.left},0)`})
      .call(d3.svg.axis().scale(y).orient('left').tickSize(-(width - margin.left - margin.right)).tickFormat(label(decades(y) > 4)));
    svg.append('text').attr({x: width - margin.right, y: height - 8, 'text-anchor': 'end'}).text('time, ms (log); lower left is better');
    svg.append('text').attr({x: 4, y: 14}).text('penumbra rmse (log)');

    const front = shown.filter(r => r.pareto).sort((a, b) => a.time_ms.median - b.time_ms.median);
    svg.append('path').attr('class', 'front').attr('d', d3.svg.line().x(r => x(r.time_ms.median)).y(r => y(r.figures.penumbra_rmse))
      .interpolate('step-after')(front));
    // Dominated ones below, in order of time, so that the tab key goes from left to right.
    const order = shown.slice().sort((a, b) => a.pareto - b.pareto || a.time_ms.median - b.time_ms.median);
    const hide = () => { tip.hidden = true; };
    const show = (r, node) => {
      const box = node.getBoundingClientRect();
      tip.replaceChildren(element('b', {}, r.method), settingsText(r) || 'no settings', element('br'),
        `${ms(r.time_ms.median)} ms, penumbra rmse ${r.figures.penumbra_rmse.toPrecision(3)}`, element('br'),
        r.pareto ? 'on the Pareto front: no other is as fast and as accurate' : 'dominated: another is as fast and as accurate', ...speedupOf(r) === null ? [] :
          [element('br'), `rays take ${speedupOf(r).toFixed(1)}\u00d7 as long for this error`]);
      tip.hidden = false;
      const left = Math.min(box.right + scrollX + 8, scrollX + document.documentElement.clientWidth - tip.offsetWidth - 8);
      tip.style.left = Math.max(scrollX + 4, left) + 'px';
      tip.style.top = box.bottom + scrollY + 8 + 'px';
    };
    svg.selectAll('.point').data(order).enter().append('path')
      .attr({d: symbolOf, tabindex: 0, role: 'button',
        transform: r => `translate(${x(r.time_ms.median)},${y(r.figures.penumbra_rmse)})`,
        class: r => 'point' + (r.pareto ? '' : ' dominated'), 'data-label': r => r.label,
        'aria-label': r => `${titleOf(r)}: ${ms(r.time_ms.median)} ms, penumbra rmse ${r.figures.penumbra_rmse.toPrecision(3)}${r.pareto ? ', on the Pareto front' : ''}`})
      .style('fill', colorOf)
      .on('mouseenter', function (r) { show(r, this); }).on('mouseleave', hide)
      .on('focus', function (r) { show(r, this); }).on('blur', hide)
      .on('click', choose)
      .on('keydown', r => { if (['Enter', ' '].includes(d3.event.key)) { d3.event.preventDefault(); choose(r); } });

    const legend = element('ul', {class: 'legend'});
    const seen = [];
    for (const r of light.results) {
      if (seen.includes(r.method)) continue;
      seen.push(r.method);
      const item = element('li');
      d3.select(item).append('svg').attr('viewBox', '-8 -8 16 16').append('path')
        .attr('d', d3.svg.symbol().type(shapeOf(r)).size(100)()).style('fill', colorOf(r));
      item.append(r.method);
      legend.append(item);
    }
    legend.append(element('li', {class: 'quiet'}, 'grey: dominated, another is as fast and as accurate; dashed: the Pareto front; large: a method\u2019s defaults'));
    holder.append(legend);
    return holder;
  }

  // -------------------------------------------------------------------------------------------------------------- viewer

  function viewer(light, choose) {
    let mode = 'shaded', chosen = null, round = 0;
    const under = element('canvas'), over = element('canvas', {class: 'over'});
    const bar = element('div', {class: 'bar'}), left = element('span', {class: 'side', style: 'left:8px'}),
      right = element('span', {class: 'side', style: 'right:8px'});
    const stage = element('div', {class: 'stage'}, under, over, bar, left, right);
    const slider = element('input', {type: 'range', class: 'slider', min: 0, max: 100, step: 0.5, value: 50,
      'aria-label': 'From the method (left) to the truth (right)'});
    const cut = () => {
      over.style.clipPath = `inset(0 ${100 - slider.value}% 0 0)`;
      bar.style.left = slider.value + '%';
    };
    slider.addEventListener('input', cut);
    const drag = event => {
      if (event.type === 'pointermove' && !(event.buttons & 1)) return;
      const box = stage.getBoundingClientRect();
      slider.value = 100 * (event.clientX - box.left) / box.width;
      cut();
    };
    stage.addEventListener('pointerdown', drag);
    stage.addEventListener('pointermove', drag);
    const select = element('select', {'aria-label': 'Method', onchange: () => choose(light.results[select.value])},
      ...light.results.map((r, i) => element('option', {value: i}, titleOf(r))));
    const scale = element('div', {class: 'scale'});
    const stops = [];
    for (let i = 0; i <= 20; ++i) {
      const c = [0, 0, 0, 0];
      errorColor((i / 10 - 1) * errorRange, errorRange, c, 0);
      stops.push(`rgb(${c.slice(0, 3).map(Math.round).join(' ')})`);
    }
    const ramp = element('i');
    ramp.style.background = `linear-gradient(to right, ${stops.join(',')})`;
    scale.append(`too dark, \u2212${errorRange}`, ramp, `+${errorRange}, too light`);
    const buttons = ['shaded', 'visibility', 'error'].map(name => element('button', {type: 'button', 'aria-pressed': name === mode,
      onclick: () => { mode = name; draw(); }}, name));
    const full = element('input', {type: 'checkbox', onchange: () => stage.classList.toggle('full', full.checked)});

    async function draw() {
      const mine = ++round;
      buttons.forEach(b => b.setAttribute('aria-pressed', b.textContent === mode));
      scale.hidden = mode !== 'error';
      select.value = light.results.indexOf(chosen);
      left.textContent = (mode === 'error' ? 'error of ' : '') + chosen.method;
      right.textContent = mode === 'error' ? 'truth, shaded' : 'truth';
      const a = element('canvas'), b = element('canvas');
      await paint(a, mode, light, chosen.picture);
      await paint(b, mode === 'error' ? 'shaded' : mode, light, light.pictures.truth.picture);
      if (mine !== round) return;
      for (const [from, to] of [[a, over], [b, under]]) {
        to.width = from.width;
        to.height = from.height;
        to.getContext('2d').drawImage(from, 0, 0);
      }
      stage.dataset.shows = mode + ' ' + chosen.label;
      cut();
    }
    const holder = element('div', {class: 'panel'}, element('div', {class: 'tools'}, select, element('span', {role: 'group', 'aria-label': 'View'}, ...buttons.flatMap(b => [b, ' '])),
      element('label', {}, full, 'one pixel a pixel')), element('div', {class: 'viewer'}, stage), slider, scale);
    return {holder, show(r) { chosen = r; draw(); }};
  }

  /// Thumbnails of methods at their defaults and of all on the Pareto front, drawn when they come into sight.
  function strips(light, choose) {
    const holder = element('div', {class: 'strips'});
    const watcher = new IntersectionObserver(entries => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        watcher.unobserve(entry.target);
        entry.target.draw();
      }
    }, {rootMargin: '200px'});
    for (const r of light.results.filter(r => r.is_default || r.pareto)) {
      const canvases = ['shaded', 'visibility', 'error'].map(mode => [mode, element('canvas', {width: 3, height: 3})]);
      const strip = element('button', {type: 'button', class: 'strip panel', onclick: () => choose(r, true), title: 'Show in the large view'},
        element('span', {}, titleOf(r)), element('div', {}, ...canvases.map(([, canvas]) => canvas)));
      strip.draw = async () => { for (const [mode, canvas] of canvases) await paint(canvas, mode, light, r.picture, 240); };
      watcher.observe(strip);
      holder.append(strip);
    }
    return holder;
  }

  // --------------------------------------------------------------------------------------------------------------- table

  function table(light, choose) {
    const figure = name => r => r.figures[name];
    const fixed = digits => value => value.toFixed(digits);
    const whole = value => String(value);
    const columns = [
      ['method', r => r.label, null],
      ['time, ms', r => r.time_ms.median, ms], ['fastest', r => r.time_ms.min, ms], ['first run', r => r.time_ms.cold, ms],
      ['speed-up over rays', speedupOf, value => value === null ? '' : value.toFixed(2) + '\u00d7'],
      ['penumbra rmse', figure('penumbra_rmse'), fixed(5)], ['rmse', figure('rmse'), fixed(5)],
      ['bias', figure('bias'), fixed(4)], ['max error', figure('max_error'), fixed(4)], ['99.9 %', figure('p999_error'), fixed(4)],
      ['bad fraction', figure('bad_fraction'), fixed(5)], ['false lit', figure('false_lit'), whole],
      ['false umbra', figure('false_umbra'), whole], ['not finite', figure('nonfinite'), whole],
      ['negative depth', r => r.negative_pixels, value => value === null ? '' : whole(value)],
      ['passes, ms', r => Object.values(r.stages_ms).reduce((a, b) => a + b, 0), null]];
    const body = element('tbody'), rows = light.results.slice();
    const heads = columns.map(([name, value], i) => element('th', {scope: 'col'}, element('button', {type: 'button', onclick: () => sort(i)}, name)));
    let column = -1, direction = 1;
    function cell([name, value, format], r) {
      if (name === 'method') {
        const link = element('button', {type: 'button', style: 'all:unset;cursor:pointer;text-decoration:underline dotted', tabindex: 0,
          onclick: () => choose(r, true)}, (r.pareto ? '\u2605 ' : '') + r.method);
        return element('td', {}, link, element('small', {}, settingsText(r)));
      }
      if (name === 'passes, ms') {
        const passes = Object.entries(r.stages_ms);
        if (!passes.length) return element('td', {}, '');
        return element('td', {}, element('details', {}, element('summary', {}, ms(value(r))), element('table', {}, element('tbody', {},
          ...passes.map(([stage, time]) => element('tr', {}, element('td', {}, stage), element('td', {}, ms(time))))))));
      }
      return element('td', {}, format(value(r)));
    }
    const line = new Map(rows.map(r => {
      const tr = element('tr', {class: r.pareto ? '' : 'dominated', 'data-label': r.label});
      tr.append(...columns.map(c => cell(c, r)));
      return [r, tr];
    }));
    function sort(i) {
      direction = column === i ? -direction : 1;
      column = i;
      const value = columns[i][1];
      const compare = (a, b) => typeof a === 'string' ? a.localeCompare(b, 'en', {numeric: true}) : a - b;
      // Rows without a value come last either way.
      rows.sort((a, b) => (value(a) === null) - (value(b) === null) || direction * compare(value(a), value(b)));
      heads.forEach((th, k) => k === i ? th.setAttribute('aria-sort', direction > 0 ? 'ascending' : 'descending') : th.removeAttribute('aria-sort'));
      body.append(...rows.map(r => line.get(r)));
    }
    sort(1);
    const holder = element('div', {class: 'panel scroll', tabindex: 0, role: 'region', 'aria-label': 'All figures'},
      element('table', {class: 'figures'}, element('thead', {}, element('tr', {}, ...heads)), body));
    return {holder, show(chosen) { for (const [r, tr] of line) tr.classList.toggle('chosen', r === chosen); }};
  }

  // --------------------------------------------------------------------------------------------------------------- cases

  function inWords(light) {
    const ours = light.results.filter(r => r.kind === 'method');
    const on = ours.filter(r => r.pareto), names = rows => [...new Set(rows.map(r => r.method))].join(', ');
    const off = ours.filter(r => !on.some(other => other.method === r.method));
    const best = ours.filter(r => speedupOf(r) !== null).sort((a, b) => speedupOf(b) - speedupOf(a))[0];
    return [on.length ? `Methods on the Pareto front of time and penumbra error: ${names(on)}.` : 'Only rays are on the Pareto front.',
      off.length ? `Dominated with all settings: ${names(off)}.` : '',
      best ? speedupOf(best) > 1 ? `Largest speed-up over rays at equal penumbra error: ${speedupOf(best).toFixed(1)}\u00d7, by ${titleOf(best)}.`
        : 'Rays reach the error of each method in less time.' : ''].filter(Boolean).join(' ');
  }

  function showCase(index, focus) {
    const {scene, light} = cases[index];
    document.querySelectorAll('#cases button').forEach((b, i) => b.setAttribute('aria-current', i === index));
    tip.hidden = true;
    const figures = light.results.length ? light.results[0].figures : {counted_pixels: 0, penumbra_pixels: 0};
    main.replaceChildren(element('h2', {tabindex: -1}, `${scene.name}, light ${light.name}`));
    main.append(element('p', {class: 'quiet'}, `${scene.triangles.toLocaleString('en')} triangles, ${scene.resolution.join('\u00d7')} pixels: ` +
      `${figures.counted_pixels.toLocaleString('en')} face the light, ${figures.penumbra_pixels.toLocaleString('en')} of them in penumbra. ` +
      `Light radius ${light.radius}. Building the tree for rays took ${ms(light.tree_build_ms)} ms, which their times do not contain.`));
    const check = light.truth_check;
    main.append(element('p', {class: 'quiet', id: 'truth-check'}, `The truth was checked at ${check.pixels.toLocaleString('en')} random pixels, traced ` +
      `again with the same ${report.truth_samples} samples in double precision by other code: ` + (check.differing === 0 ? 'none differs.' :
        `${check.differing} differ, by at most ${check.largest_difference.toFixed(6)}, on average ${check.mean_difference.toExponential(1)}.`)));
    if (!light.results.length) return;
    main.append(element('p', {}, inWords(light)));
    const parts = [];
    const choose = (r, scroll) => {
      parts.forEach(part => part.show(r));
      main.querySelectorAll('.point').forEach(p => p.classList.toggle('chosen', p.dataset.label === r.label));
      if (scroll === true) parts[0].holder.scrollIntoView({block: 'nearest'});
    };
    const large = viewer(light, choose), all = table(light, choose);
    parts.push(large, all);
    main.append(element('h3', {}, 'Time against error'), plot(light, choose), element('h3', {}, 'Method and truth'), large.holder,
      element('h3', {}, 'Side by side: shaded, visibility, signed error'), strips(light, choose),
      element('h3', {}, 'All figures'), all.holder,
      element('p', {class: 'quiet'}, 'Star: on the Pareto front. Speed-up over rays: the time in which rays reach the same penumbra error, divided by this time. ' +
        'Passes: medians from the device\u2019s clock. First run: with kernels taken from the cache or built.'));
    choose(light.results.find(r => r.kind === 'method' && r.pareto) || light.results[0]);
    if (focus) main.firstChild.focus();
  }
  cases.forEach(({scene, light}, i) => document.getElementById('cases').append(element('button', {type: 'button',
    onclick: () => showCase(i, true)}, scene.lights.length > 1 ? `${scene.name}, ${light.name}` : scene.name)));
  if (cases.length) showCase(0, false);
})();

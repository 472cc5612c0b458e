//! The frame of a page: style, script and tables.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// A part of a page; its text is escaped already.
pub type Html = Markup;

/// A page of its own, for light and dark screens, with what the pictures of this module need.
#[must_use]
pub fn page(title: &str, body: &Html) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main { h1 { (title) } (body) }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}

/// A table; rows shorter than the heading are filled with nothing.
#[must_use]
pub fn table(heading: &[&str], rows: &[Vec<String>]) -> Html {
    html! {
        div class="scroll" { table {
            thead { tr { @for cell in heading { th { (cell) } } } }
            tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
        } }
    }
}

const STYLE: &str = "
:root { color-scheme: light dark; --line: #8886; --mark: #c33; --shade: #8881 }
body { font: 15px/1.5 system-ui, sans-serif; margin: 0 }
main { max-width: 75rem; margin: auto; padding: 1rem }
h1 { font-size: 1.5rem } h2 { font-size: 1.15rem; margin-top: 2rem } h3 { font-size: 1rem; margin-top: 1.5rem } h4 { font-size: .9rem; margin-bottom: .3rem }
.note, dl { font-size: .9rem; max-width: 60rem } dt { font-weight: 600 } dd { margin: 0 0 .4rem 1rem }
.scroll { overflow-x: auto }
table { border-collapse: collapse; font-variant-numeric: tabular-nums }
th, td { border-bottom: 1px solid var(--line); padding: .2rem .7rem; text-align: left; white-space: nowrap }
code { background: var(--shade); padding: .1rem .3rem; border-radius: 3px }
.verdict { display: inline-block; padding: .2rem .8rem; border-radius: 4px; font-weight: 600; color: #fff; background: #666 }
.pass { background: #27823b } .warn { background: #9a6700 } .fail, .different { background: #b3261e }
figure { margin: 1rem 0; display: inline-block; max-width: 100% }
figcaption { font-size: .9rem }
img { display: block; max-width: 100%; image-rendering: pixelated }
.wipe, .flip { position: relative; display: inline-block; max-width: 100%; min-width: min(100%, 20rem); touch-action: none; cursor: ew-resize }
.flip { cursor: pointer }
.wipe img, .flip img { width: 100% }
.wipe img + img, .flip img + img { position: absolute; inset: 0; height: 100% }
.wipe hr { position: absolute; top: 0; bottom: 0; width: 2px; margin: 0 -1px; border: 0; background: var(--mark) }
.wipe:focus-visible, .flip:focus-visible { outline: 2px solid #4a90d9 }
.number { text-align: right } .guess { font-style: italic } .missing { white-space: normal; font-style: italic }
.methods { font-size: .8rem } .methods th, .methods td { padding: .2rem .4rem } .methods .first { padding-left: .9rem }
.methods tr > th[rowspan], .methods th[scope] { position: sticky; left: 0; background: Canvas } th[colspan] { text-align: center } .exact { background: var(--shade) }
.pair, .plots { display: grid; gap: 1rem; grid-template-columns: repeat(auto-fit, minmax(min(100%, 28rem), 1fr)) }
.pair figure, .plots figure { display: block; margin: 0 } .pair figure[hidden] { display: none }
.pair .wipe, .pair img, .plot svg { width: 100%; display: block }
.scale { display: flex; gap: .5rem; align-items: center; margin: .3rem 0 } select { font: inherit }
.magma { flex: 1; height: .8rem; background: linear-gradient(90deg, #000004, #1c1044, #4f127b, #812581, #b5367a, #e55064, #fb8761, #fec287, #fcfdbf) }
";

/// Wipes follow the pointer while it is down, and the arrow keys; flips change with each click, space or return, or by themselves
/// with `p`; choosers put the picture and the heat map of what is selected in place. Any number of them may be on a page.
const SCRIPT: &str = "
for (const box of document.querySelectorAll('.wipe')) {
  const [, top] = box.querySelectorAll('img'), line = box.querySelector('hr');
  let at = 50;
  const show = (percent) => {
    at = Math.min(100, Math.max(0, percent));
    top.style.clipPath = `inset(0 0 0 ${at}%)`;
    line.style.left = `${at}%`;
    box.setAttribute('aria-valuenow', Math.round(at));
  };
  const follow = (event) => {
    const { left, width } = box.getBoundingClientRect();
    show(100 * (event.clientX - left) / width);
  };
  box.addEventListener('pointerdown', (event) => { box.setPointerCapture(event.pointerId); follow(event); });
  box.addEventListener('pointermove', (event) => { if (event.buttons) follow(event); });
  box.addEventListener('dragstart', (event) => event.preventDefault());
  box.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: -2, ArrowRight: 2, PageDown: -10, PageUp: 10, Home: -100, End: 100 }[event.key];
    if (step) { show(at + step); event.preventDefault(); }
  });
  show(at);
}
for (const box of document.querySelectorAll('.flip')) {
  const [, top] = box.querySelectorAll('img');
  const caption = box.parentElement.querySelector('.now'), labels = [box.dataset.first, box.dataset.second];
  let second = false, timer = null;
  const show = () => { top.hidden = !second; caption.textContent = labels[second ? 1 : 0]; };
  const turn = () => { second = !second; show(); };
  box.addEventListener('click', turn);
  box.addEventListener('keydown', (event) => {
    if (event.key === ' ' || event.key === 'Enter') turn();
    else if (event.key === 'p') timer = timer ? (clearInterval(timer), null) : setInterval(turn, 500);
    else return;
    event.preventDefault();
  });
  show();
}
for (const box of document.querySelectorAll('.chooser')) {
  const select = box.querySelector('select'), wipe = box.querySelector('.wipe'), [, top] = wipe.querySelectorAll('img');
  const heat = box.querySelector('.heat'), map = heat.querySelector('img');
  const first = select.selectedOptions[0].dataset;
  first.picture = top.src;
  if (!heat.hidden) first.heatMap = map.src;
  select.addEventListener('change', () => {
    const { text, dataset } = select.selectedOptions[0];
    top.src = dataset.picture;
    top.alt = text;
    heat.hidden = !dataset.heatMap;
    if (dataset.heatMap) map.src = dataset.heatMap;
    for (const named of box.querySelectorAll('.chosen')) named.textContent = text;
    box.querySelector('.chosen-figures').textContent = dataset.figures;
    wipe.setAttribute('aria-label', `exact against ${text}`);
  });
}
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped() {
        let body = table(&["a<b"], &[vec!["<script>x</script>".to_owned()]]);
        let page = page("R & D", &body);
        assert!(page.contains("<title>R &amp; D</title>") && page.contains("a&lt;b"), "{page}");
        assert!(page.contains("&lt;script&gt;x"), "{page}");
        assert_eq!(page.matches("<script>").count(), 1);
        assert!(!page.contains("http"), "no network");
    }
}

// Pointing, dragging, the wheel and arrow keys on a pane: one pixel and one view, shared by all panes.
(function (rayproof) {
  "use strict";
  const CLICK = 4; // CSS pixels that a hand may shake

  // `shared` is {image, view, pixel, pinned}; change() redraws, point(x, y) tells which pixel is meant.
  rayproof.pointing = function (pane, shared, { change, point }) {
    const { canvas } = pane;
    const fingers = new Map();
    let start = null;

    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const look = (view) => { shared.view = view; change(); };
    const zoom = (factor, at) => look(rayproof.zoomed(shared.view, shared.image, pane.frame(), factor, at));

    function hover(event) {
      const [x, y] = rayproof.under(shared.view, shared.image, pane.frame(), place(event)).map(Math.floor);
      if (x >= 0 && y >= 0 && x < shared.image.width && y < shared.image.height) point(x, y);
    }

    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, place(event));
      canvas.setPointerCapture(event.pointerId);
      start = { at: place(event), view: shared.view, moved: fingers.size > 1 };
    });
    canvas.addEventListener("pointermove", (event) => {
      const held = fingers.get(event.pointerId);
      if (!held) {
        if (!shared.pinned) hover(event);
        return;
      }
      const now = place(event);
      const other = [...fingers].find(([id]) => id !== event.pointerId);
      if (other) { // two fingers: pinch
        const apart = ([ax, ay], [bx, by]) => Math.hypot(ax - bx, ay - by) || 1;
        const middle = [(now[0] + other[1][0]) / 2, (now[1] + other[1][1]) / 2];
        zoom(apart(now, other[1]) / apart(held, other[1]), middle);
      } else if (start && (start.moved || Math.hypot(now[0] - start.at[0], now[1] - start.at[1]) > CLICK)) {
        start.moved = true;
        const { scale } = rayproof.placed(start.view, shared.image, pane.frame());
        look(rayproof.kept({ ...start.view, x: start.view.x - (now[0] - start.at[0]) / scale, y: start.view.y - (now[1] - start.at[1]) / scale },
          shared.image, pane.frame()));
      }
      fingers.set(event.pointerId, now);
    });
    const release = (event) => {
      fingers.delete(event.pointerId);
      if (start && !start.moved && event.type === "pointerup") {
        shared.pinned = false;
        hover(event);
        shared.pinned = true;
        change();
      }
      if (!fingers.size) start = null;
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("dblclick", (event) => zoom(2, place(event)));
    // Only where the pane was chosen: a page must still scroll past an image.
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      zoom(2 ** (-event.deltaY / (event.deltaMode ? 8 : 240)), place(event));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      const [x, y] = shared.pixel || [0, 0];
      const stride = event.shiftKey ? 10 : 1;
      const clamp = (value, size) => Math.min(size - 1, Math.max(0, value));
      shared.pinned = true;
      point(clamp(x + stride * step[0], shared.image.width), clamp(y + stride * step[1], shared.image.height));
    });
  };
})(window.rayproof);

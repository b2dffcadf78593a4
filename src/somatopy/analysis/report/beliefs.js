(() => {
  const packed = document.getElementById("beliefs-data");
  if (!packed) return;
  const { moments, panels } = JSON.parse(packed.textContent);
  const drawn = document.querySelectorAll("#beliefs svg");
  const slider = document.getElementById("beliefs-moment");
  const when = document.getElementById("beliefs-when");
  slider.max = slider.value = moments.length - 1;
  slider.addEventListener("input", draw);
  document.getElementById("beliefs-controls").hidden = moments.length < 2;
  draw();

  function draw() {
    const t = Number(slider.value);
    when.textContent = moments[t];
    panels.forEach((panel, k) => {
      drawn[k].querySelector("image").setAttribute("href", panel.images[panel.image[t]]);
      drawn[k].querySelector("path").setAttribute("d", panel.outlines[panel.outline[t]]);
      drawn[k].querySelector("circle").setAttribute("cx", panel.mark[t][0]);
      drawn[k].querySelector("circle").setAttribute("cy", panel.mark[t][1]);
    });
  }
})();

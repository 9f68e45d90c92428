/* Draw each chart from the figure that stands in its place. */
(() => {
  const drawn = [...document.querySelectorAll(".plot")].map((place) => {
    const figure = JSON.parse(place.querySelector("script").textContent);
    place.textContent = "";
    Plotly.newPlot(place, figure.data, figure.layout, {
      responsive: true, displaylogo: false,
      modeBarButtons: [["toImage"]],
      toImageButtonOptions: { format: "svg", filename: "chart" },
    });
    return place;
  });
  const fit = () => drawn.forEach((place) => Plotly.Plots.resize(place));
  window.addEventListener("beforeprint", fit);
  window.addEventListener("afterprint", fit);
})();

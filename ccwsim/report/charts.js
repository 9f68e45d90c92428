/* Unpack plotly and draw each chart in place of the JSON of its figure. */
(async () => {
  const packed = document.getElementById("plotly");
  const bytes = Uint8Array.from(atob(packed.textContent), (letter) => letter.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const plotly = document.createElement("script");
  plotly.textContent = await new Response(plain).text();
  packed.replaceWith(plotly);
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

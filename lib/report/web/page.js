// Interactive curves: dygraphs on the same numbers that the static figures show. Without this script the page is complete.
(function () {
    "use strict";
    var place = document.getElementById("charts");
    var data = JSON.parse(document.getElementById("curves").textContent);
    if (!place || typeof Dygraph === "undefined") return;

    // Powers of ten as 10^k would need markup; plain exponents read well enough on a log axis.
    function number(value) {
        if (value === null || !isFinite(value)) return "-";
        var size = Math.abs(value);
        return size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(3) : String(parseFloat(value.toPrecision(5)));
    }

    function tick(value) {
        var size = Math.abs(value);
        return size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(0) : String(parseFloat(value.toPrecision(4)));
    }

    data.forEach(function (figure) {
        figure.panels.forEach(function (panel) {
            var box = document.createElement("div"), title = document.createElement("h3");
            var plot = document.createElement("div"), legend = document.createElement("div");
            box.className = "chart";
            plot.className = "plot";
            legend.className = "legend";
            title.textContent = figure.title + (panel.title ? ": " + panel.title.toLowerCase() : "");
            box.append(title, plot, legend);
            place.append(box);
            var series = {};
            panel.labels.forEach(function (label, i) {
                series[label] = { color: panel.colors[i], strokePattern: panel.dashes[i] };
            });
            new Dygraph(plot, panel.rows, {
                labels: ["time"].concat(panel.labels),
                series: series,
                logscale: panel.logarithmic,
                customBars: panel.banded,
                highlightSeriesOpts: { strokeWidth: 3 },
                includeZero: !panel.logarithmic,
                xlabel: "time [s]",
                ylabel: panel.y_label,
                labelsDiv: legend,
                legend: "always",
                strokeWidth: 2,
                connectSeparatedPoints: true,
                highlightCircleSize: 4,
                yLabelWidth: 18,
                axes: {
                    x: { valueFormatter: function (t) { return "t = " + number(t) + " s"; } },
                    y: { valueFormatter: number, axisLabelFormatter: tick, axisLabelWidth: 64 }
                }
            });
        });
    });
})();

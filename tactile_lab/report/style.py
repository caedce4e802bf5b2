"""The report page's style sheet; colours come from the palette's variables."""

STYLE = """
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);
font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;
font-variant-numeric:tabular-nums}
main{max-width:62rem;margin:0 auto;padding:2rem 1.25rem 4rem}
header{position:relative}
h1{font-size:1.75rem;line-height:1.2;margin:0 9rem .25rem 0}
h2{font-size:1.05rem;margin:2.25rem 0 .6rem}
h3{font-size:.9rem;margin:0 0 .3rem}
p{margin:.4rem 0}
.quiet,figcaption{color:var(--quiet);font-size:.86rem}
.mark{position:absolute;right:0;top:.2rem;margin:0;padding:.25rem .7rem;
border:1.5px solid currentColor;border-radius:.5rem;font-size:.78rem;font-weight:700;
letter-spacing:.04em;text-transform:uppercase}
.mark.simulated{color:var(--simulated)}
.mark.measured{color:var(--measured)}
.key{display:flex;flex-wrap:wrap;gap:.75rem 2.25rem;margin:1.4rem 0 0;
padding:.9rem 0;border-block:1px solid var(--rule)}
.key dt{color:var(--quiet);font-size:.8rem}
.key dd{margin:0;font-size:1.1rem;font-weight:600}
.warning{margin-top:1.4rem;padding:.1rem 1.1rem .7rem;background:var(--band);
border-left:4px solid var(--simulated);border-radius:.25rem}
.conclusion{font-size:1.05rem}
.conclusion ul{list-style:none;padding:0}
.warning h2{margin-top:.8rem}
ul{margin:.3rem 0;padding-left:1.2rem}
.wide{overflow-x:auto}
table{border-collapse:collapse;width:100%}
th,td{padding:.35rem .9rem .35rem 0;text-align:left;vertical-align:top}
.results th{font-size:.82rem;color:var(--quiet);font-weight:600;
border-bottom:1.5px solid var(--ink);white-space:nowrap}
.results td{border-bottom:1px solid var(--rule)}
.results th:not(:first-child):not(:last-child),
.results td:not(:first-child):not(:last-child){text-align:right;white-space:nowrap}
.results th:last-child,.results td:last-child{padding-left:.9rem}
.results td:first-child{font-weight:600;white-space:nowrap}
figure{margin:2rem 0 0}
figure svg{display:block;width:100%;height:auto}
figcaption{margin-top:.5rem}
.columns{columns:2 20rem;column-gap:2.5rem}
.columns>div{break-inside:avoid;margin-bottom:1.4rem}
.pairs{font-size:.88rem}
.pairs th{color:var(--quiet);font-weight:400;width:38%}
.pairs th,.pairs td{border-bottom:1px solid var(--rule);padding-block:.25rem;
overflow-wrap:anywhere}
@media print{@page{margin:15mm}
body{font-size:10pt}main{max-width:none;padding:0}
figure,.warning,.columns>div,tr{break-inside:avoid}h2{break-after:avoid}}
"""

// Paper is white, and nothing can be unfolded on it: a page is printed in the light scheme, with all that is folded.
{
  const root = document.documentElement;
  let scheme = "", folded = [];
  addEventListener("beforeprint", () => {
    scheme = root.dataset.theme;
    folded = [...document.querySelectorAll(".bd-article details:not([open])")];
    root.dataset.theme = "light";
    folded.forEach(one => { one.open = true; });
  });
  addEventListener("afterprint", () => {
    root.dataset.theme = scheme;
    folded.forEach(one => { one.open = false; });
  });
}

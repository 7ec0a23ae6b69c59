// A link opens what it leads to: the part that is folded below a heading, and all folds around its target.
{
  const unfold = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    let fold = target.querySelector(":scope > details.part") || target.closest("details");
    for (; fold; fold = fold.parentElement.closest("details")) fold.open = true;
    target.scrollIntoView();
  };
  addEventListener("hashchange", unfold);
  addEventListener("load", unfold);
}
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

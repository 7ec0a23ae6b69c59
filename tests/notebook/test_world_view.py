"""The live view of a world: in a kernel without a page, and in a real JupyterLab with the keyboard alone."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jupyter_lab import START_SECONDS, jupyter_lab, kernels, run_all
from kernels import Notebook
from places import ROOT

SET_UP = "%load_ext autograder\nfrom autograder.checks import World, launch"
DRIVER = """%%node driver
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

rclpy.init()
node = Node("driver")
wheels = node.create_publisher(Twist, "cmd_vel", 10)
command = Twist()
command.linear.x = 0.4
command.angular.z = 1.0
node.create_timer(0.05, lambda: wheels.publish(command))
rclpy.spin(node)
"""
TWO_SHOWN = """from autograder.checks import Program
from geometry_msgs.msg import Twist
drivers = [Program("driver", namespace=name) for name in ("/front", "/rear")]
robot = launch(*drivers, world=World("street", cars=["/front", "/rear"])).start()
robot.show(listen=[("/rear/cmd_vel", Twist)])
"""
SHOWN = 'robot = launch("driver", world="room").start()\nrobot.show()'


@pytest.fixture
def notebook(tmp_path: Path) -> Iterator[Notebook]:
    made = Notebook(tmp_path)
    made.run(SET_UP)
    yield made
    made.close()


def test_the_view_does_not_block_and_leaves_a_picture_with_the_trail(notebook: Notebook) -> None:
    notebook.run(DRIVER)
    shown = notebook.run(SHOWN)
    assert "A room of 6 m by 4 m with the place parking" in shown.text and "<img alt=" in shown.html, shown
    driven = notebook.run("robot._running.observer.wait(lambda: robot.car()._record.metres > 0.3, 150)")
    assert driven.result == "True"
    ended = notebook.run("robot.stop()")
    assert "update_display_data" in ended.types and "The car drove" in ended.text, ended
    assert "to see it again, run" in shown.html and "to see it again" not in ended.html
    assert "The car drove" in notebook.run("robot.draw.world()").result
    assert "moments from" in notebook.run("robot.draw.film()").result


def test_a_button_kills_one_of_two_nodes_of_a_program_while_a_cell_runs(notebook: Notebook) -> None:
    notebook.run(DRIVER)
    notebook.run(TWO_SHOWN)
    comm = notebook.run("robot._running.view._widget.comm.comm_id").result.strip("'")
    subshell = notebook.open_subshell()
    press = threading.Timer(
        1.0, notebook.tell_widget, (comm, {"do": "kill", "name": "/front/driver", "car": 0}, subshell)
    )
    press.start()
    waits = "import time\nend = time.monotonic() + 150\nfront, rear = (one for _, one in robot._running.programs)\n"
    waits += "while front.running() and time.monotonic() < end:\n    time.sleep(0.1)\nfront.running(), rear.running()"
    assert notebook.run(waits).result == "(False, True)"
    press.join()


OWN = """from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
robot = launch("driver", world="room").start()
robot.show(scan="seen", buttons={"Greet": lambda: "hello", "Break": lambda: 1 / 0})
view, news = robot._running.view, []
"""
PRESSED = """view._over.set()  # the view's own thread would take some of the news
view._thread.join()
for name in ("Greet", "Break", "Nothing"):
    view._take({"do": "press", "name": name, "car": 0})
said = {"Greet: hello", "Break: division by zero"}
robot.wait(lambda: news.extend(view._message()["news"]) or said <= set(news), 150)
"""
SEEN = """scan = LaserScan(angle_increment=0.1, range_max=8.0, ranges=[1.0, float("inf")] * 90)
sender = robot.publisher("/seen", LaserScan, qos_profile_sensor_data)
robot.wait(lambda: sender.publish(scan) or view._message()["cars"][0]["rays"], 150)
"""


def test_a_lab_adds_buttons_and_shows_the_rays_that_a_program_publishes(notebook: Notebook) -> None:
    notebook.run(DRIVER)
    assert not notebook.run(OWN).error
    assert notebook.run('view._message()["cars"][0]["rays"]').result == "[]"
    assert notebook.run(PRESSED).result == "True"
    assert notebook.run(SEEN).result == "True"


BRAKED = """import time
view, world, record, marks = robot._running.view, robot._running.world.simulation, robot.car()._record, []
robot.wait(lambda: record.metres > 0.3, 60)
view._kill("driver")
end = time.monotonic() + 60
while world.time - world.driven[""].commanded < 1.0 and time.monotonic() < end:  # it brakes after 0.3 s
    time.sleep(0.05)
    marks.extend(view._message()["brakes"])
marks.extend(view._message()["brakes"])
again = view._message()["brakes"]
view._whole = True
robot.program("driver").restart()
braked = [[round(one.pose.x, 2), round(one.pose.y, 2)] for one in record.brakes]  # more than once on a busy machine
marks == braked != [], again, view._message()["brakes"] == braked, robot.program("driver")._program.running()
"""


def test_a_mark_is_sent_once_and_a_page_that_begins_to_look_gets_all(notebook: Notebook) -> None:
    notebook.run(DRIVER)
    notebook.run(SHOWN)
    shown = notebook.run(BRAKED)
    assert shown.result == "(True, [], True, True)", shown


ALONE = """driver = Program("driver", namespace="/front")
robot = launch(driver, world=World("room", cars=["/front"])).start()
robot.show()
view, news = robot._running.view, []
view._over.set()  # the view's own thread would take some of the news
view._thread.join()
view._told = type(view._told)(robot._running, robot._running.world)
robot.wait(lambda: news.extend(view._message()["news"]) or news, 150)
news[0].partition(",")[0]
"""


def test_a_car_that_is_alone_is_not_named(notebook: Notebook) -> None:
    notebook.run(DRIVER)
    notebook.run("from autograder.checks import Program")
    assert notebook.run(ALONE).result == "'The car drives'"


def test_topics_that_are_asked_for_are_shown_with_their_last_message(notebook: Notebook) -> None:
    notebook.run(DRIVER)
    notebook.run(TWO_SHOWN)
    assert notebook.run("robot.topic('/rear/cmd_vel', Twist).listen().wait_for(1, within=150)").result == "True"
    seen = notebook.run(
        "shown = robot._running.view._message()\n{topic: said for topic, _, said in shown['rates'] if said}"
    )
    assert seen.result == "{'/rear/cmd_vel': 'linear.x=0.4, angular.z=1.0'}"
    assert notebook.run("shown['running']").result == "{'/front/driver': True, '/rear/driver': True}"


def test_an_int_that_becomes_no_number_is_told_beside_the_car_and_beside_the_message(notebook: Notebook) -> None:
    notebook.run(DRIVER.replace("= 0.4", "= 1"))
    notebook.run(TWO_SHOWN)
    assert notebook.run("robot.topic('/rear/cmd_vel', Twist).listen().wait_for(1, within=150)").result == "True"
    commanded = "all(car.wanted[1] for car in robot._running.world.simulation.driven.values())"
    assert notebook.run(f"robot._running.observer.wait(lambda: {commanded}, 150)").result == "True"
    seen = notebook.run(
        "shown = robot._running.view._message()\n"
        "shown['cars'][1]['state'] + '; ' + next(said for topic, _, said in shown['rates'] if said)"
    )
    told = "an int, not a float: write 1.0 for 1"
    assert seen.result.startswith(f"'got {told}; linear.x="), seen
    assert seen.result.endswith(f", angular.z=1.0 ({told})'"), seen


def test_what_cannot_be_shown_is_told(notebook: Notebook) -> None:
    notebook.run(DRIVER)
    assert "this launch has no world" in notebook.run('launch("driver").show()').error
    assert "nothing runs; begin with robot" in notebook.run('launch("driver", world="room").show()').error


STATE = """() => ({
  news: [...document.querySelectorAll('.aw-news li')].map(line => line.textContent),
  buttons: [...document.querySelectorAll('.aw-view button')].map(one => one.textContent),
  rates: [...document.querySelectorAll('.aw-view tr')].map(row => row.textContent),
  pose: document.querySelector('.aw-body.aw-car0').parentNode.getAttribute('transform'),
})"""


def _until(page: Any, condition: str) -> None:
    page.wait_for_function(condition, timeout=START_SECONDS * 1000)


def _says(sentence: str) -> str:
    return f"() => document.querySelector('.aw-news').textContent.includes({json.dumps(sentence)})"


def test_in_jupyterlab_it_is_driven_with_the_keyboard_and_tells_what_happens(browser: Any, tmp_path: Path) -> None:
    cells = [SET_UP, DRIVER, SHOWN, "6 * 7"]
    made = [
        {"cell_type": "code", "id": f"c{n}", "metadata": {}, "outputs": [], "execution_count": None, "source": source}
        for n, source in enumerate(cells)
    ]
    about = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    saved = {"cells": made, "metadata": about, "nbformat": 4, "nbformat_minor": 5}
    window = browser.new_context(viewport={"width": 1400, "height": 1000})
    window.set_default_timeout(START_SECONDS * 1000)
    with jupyter_lab(tmp_path) as (work, address):
        (work / "world.ipynb").write_text(json.dumps(saved))
        page, ran = run_all(window, address, "world")
        assert "42" in ran[-1]["output"] and not any(cell["error"] for cell in ran)
        page.wait_for_selector(".aw-view")
        _until(page, _says("The car drives"))
        _until(page, "() => /cmd_vel[1-9]/.test(document.querySelector('.aw-view table').textContent)")

        page.get_by_role("button", name="Kill driver").press("Enter")
        _until(page, _says("The program driver has ended."))
        _until(page, _says("The car stands at"))
        page.get_by_role("button", name="Reset").press("Enter")
        _until(page, _says("The cars are back at their starts."))
        _until(page, f"() => ({STATE})().pose.includes('rotate(0)')")

        page.locator(".aw-pad").focus()
        before = page.evaluate(STATE)["pose"]
        page.keyboard.down("ArrowUp")
        _until(page, "() => parseFloat(document.querySelector('.aw-meters meter').value) > 0.1")
        page.keyboard.up("ArrowUp")
        assert page.evaluate("document.activeElement.className") == "aw-pad"  # the notebook has not taken the key
        _until(page, "() => document.querySelector('.aw-meters meter').value === 0")
        assert page.evaluate(STATE)["pose"] != before

        page.get_by_role("button", name="Pause").press("Enter")
        _until(page, "() => document.querySelector('.aw-buttons button').textContent === 'Go on'")
        for kernel in kernels(page, address, "world"):
            page.request.delete(f"{address}api/kernels/{kernel['id']}?token=lab")
        page.close()
    window.close()


WITHOUT_A_KERNEL = """async (source) => {
  const { default: view } = await import(URL.createObjectURL(new Blob([source], { type: 'text/javascript' })));
  const room = { width: 6, height: 4, places: [], walls: [], boxes: [], parked: [], car: [0.4, 0.25] };
  const model = {
    get: () => ({ room, cars: [''], poses: [[1, 3, 0]], still: 'still', buttons: [] }),
    send: () => {}, off: () => {},
    on: (_, show) => { model.show = show; },
  };
  view.render({ model, el: document.body });
  const bodies = () => [...document.querySelectorAll('.aw-body')].map(one => one.parentNode.getAttribute('transform'));
  const said = () => document.querySelector('.aw-waits').textContent;
  const seen = [bodies(), said()];
  const car = { pose: [2, 1, 0], trail: [], rays: [], speed: 0, state: '' };
  for (const whole of [true, false]) {
    model.show({ cars: [car], whole, brakes: [], touches: [], running: {}, rates: [], news: [] });
    seen.push(bodies(), said());
  }
  return seen;
}"""


def test_before_the_first_message_the_cars_stand_where_they_were_and_a_sentence_says_so(browser: Any) -> None:
    """A busy machine may show the view for seconds before the first message comes."""
    source = (ROOT / "autograder" / "notebook" / "world_view.js").read_text()
    page = browser.new_page()
    before, waits, *then = page.evaluate(WITHOUT_A_KERNEL, source)
    page.wait_for_function(
        "() => document.querySelector('.aw-waits').textContent.includes('no message comes')",
        timeout=START_SECONDS * 1000,
    )
    page.close()
    assert before == ["translate(1 3) rotate(0)"] and "The view waits for the kernel" in waits
    assert then == [["translate(2 1) rotate(0)"], ""] * 2


SAVED_LIVE = """() => {
  const picture = document.querySelector('[class^="aw-still-"] img');
  return picture && picture.offsetHeight > 0 ? picture.alt + ' ' + picture.closest('div').innerText : '';
}"""


def test_a_notebook_saved_while_a_robot_runs_shows_its_picture_in_another_kernel(browser: Any, tmp_path: Path) -> None:
    cells = [SET_UP, DRIVER, SHOWN]
    made = [
        {"cell_type": "code", "id": f"c{n}", "metadata": {}, "outputs": [], "execution_count": None, "source": source}
        for n, source in enumerate(cells)
    ]
    about = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    saved = {"cells": made, "metadata": about, "nbformat": 4, "nbformat_minor": 5}
    window = browser.new_context(viewport={"width": 1400, "height": 1000})
    window.set_default_timeout(START_SECONDS * 1000)
    with jupyter_lab(tmp_path) as (work, address):
        path = work / "world.ipynb"
        path.write_text(json.dumps(saved))
        page, ran = run_all(window, address, "world")
        assert not any(cell["error"] for cell in ran)
        page.wait_for_selector(".aw-view")
        _until(page, f"() => ({SAVED_LIVE})() === ''")
        assert page.locator("[class^='aw-still-'] img").count() == 1
        page.keyboard.press("Control+s")
        _until(page, "() => !document.querySelector('.jp-mod-dirty')")
        deadline = time.monotonic() + START_SECONDS
        while "aw-still-" not in path.read_text():
            assert time.monotonic() < deadline, "the notebook was not saved with its output"
            page.wait_for_timeout(200)
        for kernel in kernels(page, address, "world"):
            page.request.delete(f"{address}api/kernels/{kernel['id']}?token=lab")
        page.close()

        again = window.new_page()
        again.goto(f"{address}lab/workspaces/again/tree/world.ipynb?token=lab&reset")
        _until(again, f"() => ({SAVED_LIVE})().includes('A room of 6 m by 4 m')")
        assert "to see it again, run the notebook's cells up to this one" in again.evaluate(SAVED_LIVE)
        again.close()
    window.close()
